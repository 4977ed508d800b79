# vidtrack: from recordings to positions. This is the door; the workflow is in workflow/Snakefile.
include: "workflow/Snakefile"


# Snakemake forgets the target of a file that is included.
workflow.default_target = TARGET
