"""Every command's options and help; the work is done in a module of the command's name beside this folder."""
