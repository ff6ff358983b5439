"""The process of the virtual cabinet: realtime loop, JVM, operator, project files, viewer.

`cabinet` puts everything together; `java_plant` is the seam to the Java side; `standalone_fri` runs FRI without Java.
"""
