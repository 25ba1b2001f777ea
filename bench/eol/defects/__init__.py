"""What a plan lets through: virtual motors with every defect there is, measured by the plan, and what its limits make of them."""
