"""The detection of defects by a plan: virtual motors with every known defect, measured by the plan and judged by its limits."""
