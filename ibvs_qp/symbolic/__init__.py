"""CasADi functions: registry of their symbols, evaluation on arrays, translation to machine code."""
