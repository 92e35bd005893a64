"""From a plant file's records to a judged design."""
