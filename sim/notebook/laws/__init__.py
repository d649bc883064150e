"""For 03_qp_vs_analytic: both laws on the same ticks, and side by side in the closed loop."""
