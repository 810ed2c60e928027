"""From events and trips to trajectories, link states, network states and the summary."""
