"""The frozen records that flow between the passes."""
