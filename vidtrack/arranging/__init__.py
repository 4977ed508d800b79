"""From a folder of recordings in any arrangement to an experiment folder: what is proposed, and what is written."""
