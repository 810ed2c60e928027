"""What a scenario changes: measures of runs, paired by seed, and tables of their differences."""
