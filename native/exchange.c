/* A request and its answer over a connected socket in one function that Python can call, and a state in another.

Python runs signal handlers between two instructions of its own, never within a function in C: so Ctrl-C comes before a
request or after its answer, and none of the frames is cut.

Written against the limited API of Python 3.10. A frame's tag is computed by `FrameTag.of`, so that HMAC stands once. */

#include "module.h"

#include <errno.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/types.h>

#include "frame_layout.h"

/* what `line`, the tuple of a connection, contains: the parameters of `compiled_link` in exchange.py */
enum { COUNTS, WAITING, TAGS, LEFT, PENDING, SPARE, SOCKET, TAKE_READING, END_READING, TAKE_SENDING, END_SENDING };
/* what `counts` contains: see heptarm.wire.session */
enum { SENT, RECEIVED, REQUESTED, UNREAD };
/* what `tags` contains in a session with a key: of our frames, of the other side's */
enum { OURS, THEIRS };
static PyObject *of; /* name of the method of a FrameTag */
/* longest body of a request, what is read at once [bytes] */
enum { LONGEST = 1024, ROOM = 16384 };

static PyObject *part(PyObject *line, Py_ssize_t which)
{
    return PyTuple_GetItem(line, which);
}

static int takes(PyObject *line, Py_ssize_t which)
{
    PyObject *taken = PyObject_CallFunctionObjArgs(part(line, which), Py_False, NULL);
    Py_XDECREF(taken);
    return taken == Py_True;
}

static void ends(PyObject *line, Py_ssize_t which)
{
    Py_XDECREF(PyObject_CallFunctionObjArgs(part(line, which), NULL));
}

static int descriptor(PyObject *line)
{
    PyObject *number = PyObject_CallFunctionObjArgs(part(line, SOCKET), NULL);
    int socket = (int)PyLong_AsLong(number);
    Py_XDECREF(number);
    return socket;
}

static uint32_t counted(PyObject *line, Py_ssize_t which)
{
    return (uint32_t)PyLong_AsUnsignedLong(PyList_GetItem(part(line, COUNTS), which));
}

static void set(PyObject *line, Py_ssize_t which, uint32_t value)
{
    PyList_SetItem(part(line, COUNTS), which, PyLong_FromUnsignedLong(value));
}

static void put(uint8_t *at, uint64_t value, int size)
{
    while (size--) {
        at[size] = (uint8_t)value;
        value >>= 8;
    }
}

static uint64_t get(const uint8_t *at, int size)
{
    uint64_t value = 0;
    for (int i = 0; i < size; i++)
        value = value << 8 | at[i];
    return value;
}

/* Whether the frames of this session have tags. */
static int is_tagged(PyObject *line)
{
    return PyList_Size(part(line, TAGS)) != 0;
}

/* Compute the tag of a frame. Returns whether it was possible. */
static int tag(PyObject *line, Py_ssize_t whose, const uint8_t *frame, size_t size, uint8_t *tag)
{
    PyObject *bytes = PyBytes_FromStringAndSize((const char *)frame, (Py_ssize_t)size);
    PyObject *made = bytes ? PyObject_CallMethodObjArgs(PyList_GetItem(part(line, TAGS), whose), of, bytes, NULL) : NULL;
    char *first = NULL;
    Py_ssize_t length = 0;
    int done = made != NULL && !PyBytes_AsStringAndSize(made, &first, &length) && length == TAG;
    if (done)
        memcpy(tag, first, TAG);
    Py_XDECREF(bytes);
    Py_XDECREF(made);
    PyErr_Clear();
    return done;
}

/* Send a whole frame. Returns 1; 0 if nothing could be sent at once; -1 with errno. */
static int sends(int socket, const uint8_t *frame, size_t size)
{
    ssize_t done = send(socket, frame, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (done < 0)
        return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? 0 : -1;
    if ((size_t)done == size)
        return 1;
    void *thread = PyEval_SaveThread();
    while ((size_t)done < size) {
        ssize_t more = send(socket, frame + done, size - (size_t)done, MSG_NOSIGNAL);
        if (more < 0 && errno != EINTR)
            break;
        done += more < 0 ? 0 : more;
    }
    int error = errno;
    PyEval_RestoreThread(thread);
    errno = error;
    return (size_t)done == size ? 1 : -1;
}

/* Send the frame of a request, whose id is put into `request`: as `sends`. */
static int asks(PyObject *line, int socket, uint32_t *request, long type, int64_t time, const char *body, size_t size)
{
    uint8_t frame[HEADER + LONGEST + TAG];
    if (!takes(line, TAKE_SENDING))
        return 0;
    int tagged = is_tagged(line);
    uint32_t seq = counted(line, SENT), last = counted(line, REQUESTED);
    *request = last == UINT32_MAX ? 1 : last + 1;
    put(frame + AT_MAGIC, MAGIC, SIZE_MAGIC);
    put(frame + AT_VERSION, MAJOR, SIZE_VERSION);
    put(frame + AT_FLAGS, (uint64_t)tagged, SIZE_FLAGS);
    put(frame + AT_TYPE, (uint64_t)type, SIZE_TYPE);
    put(frame + AT_LENGTH, size, SIZE_LENGTH);
    put(frame + AT_SEQ, seq, SIZE_SEQ);
    put(frame + AT_REQUEST, *request, SIZE_REQUEST);
    put(frame + AT_TIME, (uint64_t)time, SIZE_TIME);
    memcpy(frame + HEADER, body, size);
    size += HEADER;
    int sent = 0;
    if (seq != UINT32_MAX && (!tagged || tag(line, OURS, frame, size, frame + size))) /* then the tags begin again */
        sent = sends(socket, frame, size + (tagged ? TAG : 0));
    int error = errno;
    if (sent > 0) {
        set(line, SENT, seq + 1);
        set(line, REQUESTED, *request);
    }
    ends(line, END_SENDING);
    errno = error;
    return sent;
}

/* The first of a pair, and the body of a frame. */
static PyObject *pair(PyObject *first, const uint8_t *frame, ssize_t length)
{
    PyObject *body = PyBytes_FromStringAndSize((const char *)frame + HEADER, length);
    PyObject *both = first && body ? PyTuple_Pack(2, first, body) : NULL;
    Py_XDECREF(first);
    Py_XDECREF(body);
    return both;
}

static void keep(PyObject *line, const uint8_t *data, ssize_t size)
{
    PyObject *left = PyBytes_FromStringAndSize((const char *)data, size);
    PyList_Append(part(line, LEFT), left);
    Py_XDECREF(left);
}

/* Receive what has come, or wait for it. Returns its size; 0 at the end; -1: nothing; -2 with errno: the connection is
lost. */
static ssize_t receives(int socket, uint8_t *data, int flags)
{
    void *thread = PyEval_SaveThread();
    ssize_t size = recv(socket, data, ROOM, flags);
    int error = errno;
    PyEval_RestoreThread(thread);
    errno = error;
    if (size >= 0)
        return size;
    return error == EAGAIN || error == EWOULDBLOCK || error == EINTR || error == ETIMEDOUT ? -1 : -2;
}

/* Size of the body if the data are the next frame of the other side, of this request, and nothing else; otherwise -1. */
static ssize_t whole(PyObject *line, uint32_t request, const uint8_t *data, ssize_t size)
{
    int tagged = is_tagged(line);
    ssize_t body = size - HEADER - (tagged ? TAG : 0);
    if (body < 0 || get(data + AT_MAGIC, SIZE_MAGIC) != MAGIC || get(data + AT_VERSION, SIZE_VERSION) != MAJOR
        || get(data + AT_FLAGS, SIZE_FLAGS) != (uint64_t)tagged || get(data + AT_LENGTH, SIZE_LENGTH) != (uint64_t)body
        || get(data + AT_SEQ, SIZE_SEQ) != counted(line, RECEIVED) || counted(line, RECEIVED) == UINT32_MAX
        || get(data + AT_REQUEST, SIZE_REQUEST) != request)
        return -1;
    if (tagged) {
        uint8_t right[TAG];
        int differs = !tag(line, THEIRS, data, (size_t)(HEADER + body), right);
        for (int i = 0; i < TAG; i++)
            differs |= right[i] ^ data[HEADER + body + i];
        if (differs)
            return -1;
    }
    return body;
}

/* Leave a request whose answer has not come yet to those who read next. Returns its PendingRequest. */
static PyObject *leave(PyObject *line, uint32_t request, PyObject *kind, const uint8_t *data, ssize_t size)
{
    PyObject *number = PyLong_FromUnsignedLong(request), *spare = part(line, SPARE);
    Py_ssize_t last = PyList_Size(spare) - 1;
    PyObject *pending = PyList_GetItem(spare, last);
    Py_INCREF(pending);
    PyList_SetSlice(spare, last, last + 1, NULL);
    PyDict_SetItem(part(line, WAITING), number, kind);
    PyDict_SetItem(part(line, PENDING), number, pending);
    if (size > 0)
        keep(line, data, size);
    Py_XDECREF(number);
    return pending;
}

/* Wait for what comes next. Returns (type, body) of the answer, or what `leave` returns; NULL with errno. */
static PyObject *answer(PyObject *line, int socket, uint32_t request, PyObject *kind)
{
    uint8_t data[ROOM];
    ssize_t size = receives(socket, data, 0);
    if (size < -1)
        return NULL;
    ssize_t length = whole(line, request, data, size);
    if (length < 0)
        return leave(line, request, kind, data, size);
    set(line, RECEIVED, counted(line, RECEIVED) + 1);
    return pair(PyLong_FromUnsignedLong((unsigned long)get(data + AT_TYPE, SIZE_TYPE)), data, length);
}

/* exchange(kind, type, time, body): see exchange.py. */
static PyObject *exchange(PyObject *line, PyObject *const *given, Py_ssize_t count)
{
    char *body;
    Py_ssize_t size;
    if (count != 4) {
        PyErr_SetString(PyExc_TypeError, "exchange takes kind, type, time and body");
        return NULL;
    }
    if (PyBytes_AsStringAndSize(given[3], &body, &size))
        return NULL;
    long type = PyLong_AsLong(given[1]);
    int64_t time = PyLong_AsLongLong(given[2]);
    if (PyErr_Occurred())
        return NULL;
    int socket = descriptor(line), sent = 0, error = 0;
    PyObject *result = NULL;
    if (socket >= 0 && size <= LONGEST && takes(line, TAKE_READING)) {
        uint32_t request;
        if (PyList_Size(part(line, SPARE)) && !PyList_Size(part(line, LEFT)) && !counted(line, UNREAD))
            sent = asks(line, socket, &request, type, time, body, (size_t)size);
        if (sent > 0)
            result = answer(line, socket, request, given[0]);
        error = errno;
        ends(line, END_READING);
    }
    if (result != NULL)
        return result;
    if (sent == 0) {
        Py_INCREF(Py_None);
        return Py_None;
    }
    errno = error;
    return PyErr_SetFromErrno(PyExc_OSError);
}

/* state(type, flags): see exchange.py. */
static PyObject *state(PyObject *line, PyObject *const *given, Py_ssize_t count)
{
    if (count != 2) {
        PyErr_SetString(PyExc_TypeError, "state takes type and flags");
        return NULL;
    }
    long type = PyLong_AsLong(given[0]), flags = PyLong_AsLong(given[1]);
    if (PyErr_Occurred())
        return NULL;
    int socket = descriptor(line);
    PyObject *result = Py_False;
    if (socket >= 0 && !PyList_Size(part(line, LEFT)) && !counted(line, UNREAD)) {
        uint8_t data[ROOM];
        ssize_t size = receives(socket, data, (int)flags);
        if (size < -1)
            return PyErr_SetFromErrno(PyExc_OSError);
        ssize_t length = size >= HEADER && get(data + AT_TYPE, SIZE_TYPE) == (uint64_t)type ? whole(line, 0, data, size) : -1;
        if (length >= 0) {
            set(line, RECEIVED, counted(line, RECEIVED) + 1);
            return pair(PyLong_FromLongLong((int64_t)get(data + AT_TIME, SIZE_TIME)), data, length);
        }
        if (size > 0)
            keep(line, data, size);
        if (size < 0)
            result = Py_None;
    }
    Py_INCREF(result);
    return result;
}

static PyMethodDef methods[] = {
    {"exchange", (PyCFunction)(void (*)(void))exchange, METH_FASTCALL, NULL},
    {"state", (PyCFunction)(void (*)(void))state, METH_FASTCALL, NULL},
};

/* Both functions for one connection, whose tuple is `line`. */
PyObject *exchange_functions(PyObject *module, PyObject *line)
{
    (void)module;
    if (of == NULL && (of = PyUnicode_InternFromString("of")) == NULL)
        return NULL;
    PyObject *first = PyCFunction_New(&methods[0], line), *second = PyCFunction_New(&methods[1], line);
    PyObject *both = first && second ? PyTuple_Pack(2, first, second) : NULL;
    Py_XDECREF(first);
    Py_XDECREF(second);
    return both;
}
