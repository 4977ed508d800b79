"""Whether the numbers can be used: what every stage found and what the numbers say, as one word with its reasons."""
