"""Studies that measure Miburi: experiment, contact trials, gestures, a simulated day; figures."""
