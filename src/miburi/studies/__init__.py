"""What is measured with Miburi: the experiment, trials, gestures, a day; film and figures."""
