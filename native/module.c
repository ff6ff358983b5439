/* The module `heptarm._native`. heptarm._library loads the functions of the other files by their names. */
#include "module.h"

static PyMethodDef methods[] = {
    {"exchange_functions", exchange_functions, METH_O, PyDoc_STR("The functions of a connection; see heptarm.io.exchange.")},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "heptarm._native", PyDoc_STR("The parts of heptarm in C."), -1, methods, NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit__native(void) { return PyModule_Create(&definition); }
