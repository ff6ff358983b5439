"""FRI, the robot's hard-real-time interface, sans IO: values, codecs of every version, and the fast layouts."""
