"""One module a rule: tables, arrays and frames in, tables out; no paths, and no stage imports another."""
