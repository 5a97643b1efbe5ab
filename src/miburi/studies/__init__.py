"""Studies that measure Miburi: the experiment, contact trials, gestures, a day; film, figures."""
