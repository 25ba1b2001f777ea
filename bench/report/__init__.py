"""From a run's folder to its report and its exports."""
