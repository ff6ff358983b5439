/* Python's limited API, and what the module offers to Python by itself; all else is called through its address (ctypes). */
#ifndef HEPTARM_MODULE_H
#define HEPTARM_MODULE_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

PyObject *exchange_functions(PyObject *module, PyObject *line);

#endif
