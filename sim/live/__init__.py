"""The program in the browser: a flight that is tuned, disturbed, rewound and repeated while it flies."""
