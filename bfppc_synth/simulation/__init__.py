"""The generated controller in closed loop with the plant: evidence, never proof."""
