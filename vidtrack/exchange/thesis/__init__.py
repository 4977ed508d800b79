"""The files of the thesis's programs (appendix C: subcapt, calb, back, showcalb, tsbackm, tc, locate).

Whitespace stands between numbers; headers end with a line of =. Frame-buffer px have their origin in the centre of the
top-left pixel, X right and Y down, as vidtrack has them; world lengths are in the unit of the survey, which no file
names. The old programs skip a fixed number of lines; here a header ends where its line of = is, or where numbers begin.
"""
