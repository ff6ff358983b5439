This is not Java. Workbench does not compile it, because its folder is in no class path.
