"""Studies that measure Miburi (experiment, contact trials, gestures, a day), and figures."""
