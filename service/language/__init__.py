"""Languages of pages, messages and reports.

Everything is written, stored and exchanged in English. What people read is translated where it is shown: the texts of
templates by gettext, and sentences that the program composes by recognising the message they were composed from
(`service.language.translation`). Catalogues stand in a folder per language, one file of gettext per room;
`service.language.extraction` lists what they must contain.
"""
