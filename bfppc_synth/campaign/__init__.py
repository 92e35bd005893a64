"""Campaigns: many drawn runs of one folder's controller, and what they came to."""
