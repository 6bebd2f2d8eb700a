/* Calls from Python without Python code around them: a class whose objects take plain arrays in C.
 *
 * `_native.quick_class(base)` makes a class that inherits from `base`, a class of Python such as Kernel, and
 * `_native.quicken(object, name, kind, params...)` tells one of its objects which kernel it stands for. From then on a
 * call with nothing but plain arrays (and `out=`) is read, computed and answered here. Any other call goes to
 * `base.__call__`, which also finds the words for what is wrong. This is CPython's stable interface of 3.10; see
 * "Vectorcall" below for the one thing beyond it. Everything here runs under the interpreter lock but for batches.
 */
#define Py_LIMITED_API 0x030A0000

#include "kinegen_arrays.h"
#include "kinegen_memory.h"
#include <string.h>
#include <structmember.h>

/* Types and extents are those of NumPy. */
typedef char agrees_with_numpy[TYPE_FLOAT == NPY_FLOAT && TYPE_DOUBLE == NPY_DOUBLE
                               && sizeof(ptrdiff_t) == sizeof(npy_intp) ? 1 : -1];

/* Calls may have so many arrays, and batches so many axes; others take the way through Python. */
#define MOST_ARRAYS 8
#define MOST_AXES 8
/* Numbers of the first input of a batch whose results are made here. Larger ones are cut up in Python. */
#define SMALL 16384
/* Configurations that are worth letting other threads run meanwhile. */
#define WORTH_UNLOCKING 32

/* Vectorcall: the fields and flags are the same from CPython 3.9 on, and part of the stable interface from 3.12 on. */
typedef PyObject *(*Vectorcall)(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names);
#define FLAG_VECTORCALL (1UL << 11)
#define COUNT_OF(nargsf) ((nargsf) & ~((size_t)1 << (8 * sizeof(size_t) - 1)))

/* What an object of such a class has behind the fields of its base. */
typedef struct {
    Vectorcall call;
    const Entry *entry;
    const Entry *nearest;     /* of an inverse: the kernel of the solution nearest to a joint vector */
    const void *params[2];    /* for double and for float; the object of Python keeps them alive */
} Quick;

static Py_ssize_t quick_place;    /* of Quick in the objects; one for all classes of a process */
static void **numpy;              /* the functions of NumPy, by number */
static PyObject *truths[2];       /* False and True of NumPy */

/* The numbers are the same from NumPy 1.7 to 2. */
#define ARRAY_VERSION() (((unsigned int (*)(void))numpy[0])())
#define ARRAY_TYPE ((PyTypeObject *)numpy[2])
#define NEW_ARRAY(rank, shape, type)                                                                                   \
    (((PyObject * (*)(PyTypeObject *, int, const npy_intp *, int, const npy_intp *, void *, int, int, PyObject *))     \
          numpy[93])(ARRAY_TYPE, rank, shape, type, NULL, NULL, 0, 0, NULL))

#define FEATURES() (((unsigned int (*)(void))numpy[211])())
#define SET_HANDLER(handler) (((PyObject * (*)(PyObject *)) numpy[304])(handler))

static Quick *quick_of(PyObject *self)
{
    return (Quick *)((char *)self + quick_place);
}

/* Call `base.__call__(self, ...)`. */
static PyObject *call_base(PyObject *self, PyObject *args, PyObject *named)
{
    PyObject *const base = (PyObject *)PyType_GetSlot(Py_TYPE(self), Py_tp_base);
    /* The name is always the same object, since Python remembers what it looked up by the address of the name. */
    PyObject *const name = PyUnicode_InternFromString("__call__");
    PyObject *const function = name == NULL ? NULL : PyObject_GetAttr(base, name);
    PyObject *result = NULL;
    const Py_ssize_t count = PyTuple_Size(args);
    PyObject *const all = function == NULL ? NULL : PyTuple_New(count + 1);
    if (all != NULL) {
        Py_INCREF(self);
        PyTuple_SetItem(all, 0, self);
        for (Py_ssize_t i = 0; i < count; ++i) {
            PyObject *const argument = PyTuple_GetItem(args, i);
            Py_INCREF(argument);
            PyTuple_SetItem(all, i + 1, argument);
        }
        result = PyObject_Call(function, all, named);
        Py_DECREF(all);
    }
    Py_XDECREF(function);
    Py_XDECREF(name);
    return result;
}

/* The same for the arguments of a vectorcall. */
static PyObject *call_slowly(PyObject *self, PyObject *const *args, size_t count, PyObject *names)
{
    PyObject *const given = PyTuple_New((Py_ssize_t)count), *result = NULL;
    PyObject *const named = given != NULL && names != NULL ? PyDict_New() : NULL;
    if (given == NULL) return NULL;
    if (names == NULL || named != NULL) {
        const Py_ssize_t more = names == NULL ? 0 : PyTuple_Size(names);
        int failed = 0;
        for (size_t i = 0; i < count; ++i) {
            Py_INCREF(args[i]);
            PyTuple_SetItem(given, (Py_ssize_t)i, args[i]);
        }
        for (Py_ssize_t i = 0; i < more && !failed; ++i) {
            failed = PyDict_SetItem(named, PyTuple_GetItem(names, i), args[count + (size_t)i]) != 0;
        }
        if (!failed) result = call_base(self, given, named);
    }
    Py_DECREF(given);
    Py_XDECREF(named);
    return result;
}

/* Whether a thing is an array and nothing more particular. */
static int is_array(PyObject *thing)
{
    return Py_TYPE(thing) == ARRAY_TYPE;
}

/* Whether an array is one configuration of a form, in one piece. */
static int is_single(PyArrayObject *array, const Form *form, int type, int flags)
{
    if (PyArray_NDIM(array) != form->rank || PyArray_TYPE(array) != entry_type(form, type)) return 0;
    for (int i = 0; i < form->rank; ++i) {
        if (PyArray_DIM(array, i) != form->shape[i]) return 0;
    }
    return is_behaved(array, NPY_ARRAY_C_CONTIGUOUS | flags);
}

/* Find the arrays of a call with one configuration; those from `known` on are fresh, and need no look. */
static int read_single(const Entry *entry, PyArrayObject *const *arrays, int known, Place *places, Call *call)
{
    const int type = PyArray_TYPE(arrays[0]);
    if (type != NPY_DOUBLE && type != NPY_FLOAT) return 0;
    for (int i = 0; i < known; ++i) {
        const int is_result = i >= entry->inputs;
        if (!is_single(arrays[i], &entry->forms[i], type, is_result ? NPY_ARRAY_WRITEABLE : 0)) return 0;
        for (int other = 0; is_result && other < i; ++other) {
            const Form *const first = &entry->forms[other], *const second = &entry->forms[i];
            const npy_intp first_size = bytes_of(first, type), second_size = bytes_of(second, type);
            if (first->is_empty || second->is_empty) continue;
            if (!are_apart(arrays[other], first_size, arrays[i], second_size)) return 0;
        }
    }
    for (int i = 0; i < known; ++i) places[i] = (Place){PyArray_DATA(arrays[i]), 0, 1};
    *call = (Call){type, 1, 1, 0};
    return 1;
}

/* Make the results of a call whose first input has `lead` axes of a batch; 0, with an exception, without memory. */
static int make_results(const Entry *entry, PyArrayObject **arrays, int lead)
{
    npy_intp shape[MOST_AXES + 4];
    for (int i = 0; i < lead; ++i) shape[i] = PyArray_DIM(arrays[0], i);
    for (int i = entry->inputs; i < entry->arrays; ++i) {
        const Form *const form = &entry->forms[i];
        for (int k = 0; k < form->rank; ++k) shape[lead + k] = form->shape[k];
        arrays[i] = (PyArrayObject *)NEW_ARRAY(lead + form->rank, shape, entry_type(form, PyArray_TYPE(arrays[0])));
        if (arrays[i] == NULL) {
            while (--i >= entry->inputs) Py_DECREF(arrays[i]);
            return 0;
        }
    }
    return 1;
}

static void drop_results(const Entry *entry, PyArrayObject **arrays)
{
    for (int i = entry->inputs; i < entry->arrays; ++i) Py_DECREF(arrays[i]);
}

/* The results as a call gives them: one array or a tuple. It takes over the references. */
static PyObject *handed_on(const Entry *entry, PyArrayObject **arrays)
{
    const int count = entry->arrays - entry->inputs;
    PyObject *tuple;
    if (count == 1) return (PyObject *)arrays[entry->inputs];
    tuple = PyTuple_New(count);
    if (tuple == NULL) {
        drop_results(entry, arrays);
        return NULL;
    }
    for (int i = 0; i < count; ++i) PyTuple_SetItem(tuple, i, (PyObject *)arrays[entry->inputs + i]);
    return tuple;
}

/* Evaluate plain arrays; 0 where the kernel cannot use them where they lie. */
static int evaluate(const Quick *quick, PyArrayObject *const *arrays, int lead, int known)
{
    const Entry *const entry = quick->entry;
    uintptr_t addresses[MOST_ARRAYS];
    Place places[MOST_ARRAYS];
    Call call;
    int done;
    if (lead == 0) {
        if (!read_single(entry, arrays, known, places, &call)) return 0;
        for (int i = known; i < entry->arrays; ++i) places[i] = (Place){PyArray_DATA(arrays[i]), 0, 1};
        return entry->run(quick->params, places, &call, LAYOUT_4X4);
    }
    for (int i = 0; i < entry->arrays; ++i) addresses[i] = (uintptr_t)arrays[i];
    if (!kinegen_read_arrays(addresses, entry->forms, entry->inputs, entry->arrays, LAYOUT_4X4, places, &call)) return 0;
    if (call.count < WORTH_UNLOCKING) return entry->run(quick->params, places, &call, LAYOUT_4X4);
    Py_BEGIN_ALLOW_THREADS
    done = entry->run(quick->params, places, &call, LAYOUT_4X4);
    Py_END_ALLOW_THREADS
    return done;
}

/* The results that were given with `out=`, as arrays; 0 where they are something else. */
static int take_results(const Entry *entry, PyObject *out, PyArrayObject **arrays)
{
    const int count = entry->arrays - entry->inputs;
    if (count > 1 && (!PyTuple_CheckExact(out) || PyTuple_Size(out) != count)) return 0;
    for (int i = 0; i < count; ++i) {
        PyObject *const each = count == 1 ? out : PyTuple_GetItem(out, i);
        if (!is_array(each)) return 0;
        arrays[entry->inputs + i] = (PyArrayObject *)each;
    }
    return 1;
}

/* The inputs as arrays, and the number of axes of the batch; -1 where they are something else. */
static int take_inputs(const Entry *entry, PyObject *const *args, PyArrayObject **arrays)
{
    for (int i = 0; i < entry->inputs; ++i) {
        if (!is_array(args[i])) return -1;
        arrays[i] = (PyArrayObject *)args[i];
    }
    return PyArray_NDIM(arrays[0]) - entry->forms[0].rank;
}

/* Whether results may be made for the first input: its shape and type are right, and it is small. */
static int is_worth_results(const Entry *entry, PyArrayObject *first, int lead)
{
    const Form *const form = &entry->forms[0];
    const int type = PyArray_TYPE(first);
    npy_intp numbers = 1;
    for (int i = 0; i < lead; ++i) numbers *= PyArray_DIM(first, i);
    for (int i = 0; i < form->rank; ++i) {
        if (PyArray_DIM(first, lead + i) != form->shape[i]) return 0;
        numbers *= form->shape[i];
    }
    return numbers < SMALL && (type == NPY_DOUBLE || type == NPY_FLOAT);
}

/* A call of a kernel: `kernel(q)`, `kernel(q, qd)`, `kernel(q, out=T)`. */
static PyObject *call_kernel(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    const Quick *const quick = quick_of(self);
    const Entry *const entry = quick->entry;
    const size_t count = COUNT_OF(nargsf);
    PyArrayObject *arrays[MOST_ARRAYS];
    PyObject *out = NULL;
    int lead;
    if (count != (size_t)entry->inputs) return call_slowly(self, args, count, names);
    if (names != NULL) {
        if (PyTuple_Size(names) != 1 || PyUnicode_CompareWithASCIIString(PyTuple_GetItem(names, 0), "out") != 0) {
            return call_slowly(self, args, count, names);
        }
        out = args[count] == Py_None ? NULL : args[count];
    }
    lead = take_inputs(entry, args, arrays);
    if (lead < 0 || lead > MOST_AXES) return call_slowly(self, args, count, names);
    if (out != NULL) {
        if (!take_results(entry, out, arrays) || !evaluate(quick, arrays, lead, entry->arrays)) {
            return call_slowly(self, args, count, names);
        }
        Py_INCREF(out);
        return out;
    }
    if (!is_worth_results(entry, arrays[0], lead)) return call_slowly(self, args, count, names);
    if (!make_results(entry, arrays, lead)) return NULL;
    if (evaluate(quick, arrays, lead, entry->inputs)) return handed_on(entry, arrays);
    drop_results(entry, arrays);
    return call_slowly(self, args, count, names);
}

/* Whether a matrix is beyond doubt a pose: the question that `is_pose` in _targets.py answers. */
static int is_pose(const double *m, double allowed)
{
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
#define NEAR(value) ((value) <= allowed && -(value) <= allowed)
    return NEAR(a * a + b * b + c * c - 1) && NEAR(d * d + e * e + f * f - 1) && NEAR(a * d + b * e + c * f)
        && NEAR(b * f - c * e - g) && NEAR(c * d - a * f - h) && NEAR(a * e - b * d - i)
        && m[3] - m[3] == 0 && m[7] - m[7] == 0 && m[11] - m[11] == 0
        && m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1;
#undef NEAR
}

/* Whether the numbers of one target are a pose. */
static int is_target(const void *data, int type)
{
    double m[16];
    for (int i = 0; i < 16; ++i) m[i] = type == NPY_DOUBLE ? ((const double *)data)[i] : ((const float *)data)[i];
    return is_pose(m, type == NPY_DOUBLE ? 1e-6 / 4 : 1e-4 / 4);
}

/* A call of an inverse with one target and a joint vector: `inverse(T, nearest=q0)`. */
static PyObject *call_nearest(PyObject *self, PyObject *const *args, PyObject *names)
{
    const Quick *const quick = quick_of(self);
    const Entry *const entry = quick->nearest;
    PyArrayObject *arrays[4];
    Place places[4];
    Call call;
    npy_bool exists;
    PyObject *result;
    int found;
    if (take_inputs(entry, args, arrays) != 0 || !read_single(entry, arrays, 2, places, &call)
        || !is_target(places[0].data, call.type)) {
        return call_slowly(self, args, 1, names);
    }
    arrays[2] = (PyArrayObject *)NEW_ARRAY(1, (const npy_intp *)entry->forms[2].shape, call.type);
    result = arrays[2] == NULL ? NULL : PyTuple_New(2);
    if (result == NULL) {
        Py_XDECREF(arrays[2]);
        return NULL;
    }
    places[2] = (Place){PyArray_DATA(arrays[2]), 0, 1};
    places[3] = (Place){&exists, 0, 1};
    found = entry->run(quick->params, places, &call, LAYOUT_4X4);
    PyTuple_SetItem(result, 0, (PyObject *)arrays[2]);
    if (!found) {
        Py_DECREF(result);
        return call_slowly(self, args, 1, names);
    }
    Py_INCREF(truths[exists != 0]);
    PyTuple_SetItem(result, 1, truths[exists != 0]);
    return result;
}

/* Whether a call has one named argument of this name. */
static int is_alone(PyObject *names, const char *name)
{
    return names != NULL && PyTuple_Size(names) == 1
        && PyUnicode_CompareWithASCIIString(PyTuple_GetItem(names, 0), name) == 0;
}

/* A call of an inverse with one target: `inverse(T)`. */
static PyObject *call_inverse(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *names)
{
    const Quick *const quick = quick_of(self);
    const Entry *const entry = quick->entry;
    const size_t count = COUNT_OF(nargsf);
    PyArrayObject *arrays[MOST_ARRAYS];
    if (count == 1 && quick->nearest != NULL && is_alone(names, "nearest")) return call_nearest(self, args, names);
    if (count != 1 || names != NULL || take_inputs(entry, args, arrays) != 0
        || !is_single(arrays[0], &entry->forms[0], PyArray_TYPE(arrays[0]), 0)
        || !is_target(PyArray_DATA(arrays[0]), PyArray_TYPE(arrays[0]))) {
        return call_slowly(self, args, count, names);
    }
    if (!make_results(entry, arrays, 0)) return NULL;
    if (evaluate(quick, arrays, 0, entry->inputs)) return handed_on(entry, arrays);
    drop_results(entry, arrays);
    return call_slowly(self, args, count, names);
}

/* Find the functions of NumPy; 0, without an exception, where it is none of those that are known. */
static int find_numpy(void)
{
    static const char *const homes[] = {"numpy._core._multiarray_umath", "numpy.core._multiarray_umath"};
    for (int i = 0; i < 2 && numpy == NULL; ++i) {
        PyObject *const module = PyImport_ImportModule(homes[i]);
        PyObject *const table = module == NULL ? NULL : PyObject_GetAttrString(module, "_ARRAY_API");
        if (table != NULL) numpy = (void **)PyCapsule_GetPointer(table, NULL);
        Py_XDECREF(table);
        Py_XDECREF(module);
        PyErr_Clear();
    }
    if (numpy != NULL && truths[1] == NULL) {
        PyObject *const module = PyImport_ImportModule("numpy");
        if (module != NULL) truths[0] = PyObject_GetAttrString(module, "False_");
        if (module != NULL) truths[1] = PyObject_GetAttrString(module, "True_");
        Py_XDECREF(module);
        PyErr_Clear();
        if (truths[0] == NULL || truths[1] == NULL) return 0;
    }
    return numpy != NULL && (ARRAY_VERSION() >> 24 == 1 || ARRAY_VERSION() >> 24 == 2);
}

/* quick_class(base): a class whose objects may be quickened; None where that cannot be. */
static PyObject *quick_class(PyObject *module, PyObject *base)
{
    PyObject *const number = PyObject_GetAttrString(base, "__basicsize__"), *bases, *made;
    const Py_ssize_t size = number == NULL ? -1 : PyLong_AsSsize_t(number);
    const Py_ssize_t place = (size + 15) / 16 * 16;
    PyMemberDef members[] = {{"__vectorcalloffset__", T_PYSSIZET, place, READONLY, NULL}, {NULL, 0, 0, 0, NULL}};
    PyType_Slot slots[] = {{Py_tp_call, (void *)call_base}, {Py_tp_members, members}, {0, NULL}};
    PyType_Spec spec = {"kinegen.Kernel", (int)(place + (Py_ssize_t)sizeof(Quick)), 0,
                        Py_TPFLAGS_DEFAULT | FLAG_VECTORCALL, slots};
    (void)module;
    Py_XDECREF(number);
    if (size < 0) return NULL;
    if (!find_numpy() || (quick_place != 0 && quick_place != place)) Py_RETURN_NONE;
    quick_place = place;
    bases = PyTuple_Pack(1, base);
    made = bases == NULL ? NULL : PyType_FromSpecWithBases(&spec, bases);
    Py_XDECREF(bases);
    return made;
}

/* empty_large(empty, shape, dtype): what `empty(shape, dtype)` of NumPy gives, in memory that is used again. */
static PyObject *empty_large(PyObject *module, PyObject *args)
{
    PyObject *empty, *shape, *type, *result, *error[3];
    PyObject *handler = NULL, *usual = NULL;
    (void)module;
    if (!PyArg_ParseTuple(args, "OOO", &empty, &shape, &type)) return NULL;
#ifdef KEEPS_MEMORY
    if (find_numpy() && FEATURES() >= NPY_1_22_API_VERSION) {
        handler = PyCapsule_New(&results_handler, "mem_handler", NULL);
        usual = handler == NULL ? NULL : SET_HANDLER(handler);
        Py_XDECREF(handler);
        if (usual == NULL) return NULL;
    }
#endif
    result = PyObject_CallFunctionObjArgs(empty, shape, type, NULL);
    if (usual != NULL) {
        PyErr_Fetch(&error[0], &error[1], &error[2]);
        handler = SET_HANDLER(usual);
        PyErr_Restore(error[0], error[1], error[2]);
        Py_XDECREF(handler);
        Py_DECREF(usual);
    }
    return result;
}

/* quicken(object, name, kind, params...): whether plain calls of the object go to the kernel of that name from now on.
 * The kind is "kernel" or "inverse"; parameters are addresses, for each type that there is, or 0. */
static PyObject *quicken(PyObject *module, PyObject *args)
{
    PyObject *self, *addresses[2];
    const char *name, *kind;
    const Entry *entry;
    Quick *quick;
    int is_inverse;
    (void)module;
    if (!PyArg_ParseTuple(args, "OssOO", &self, &name, &kind, &addresses[0], &addresses[1])) return NULL;
    if (PyType_GetSlot(Py_TYPE(self), Py_tp_call) != (void *)call_base) return PyBool_FromLong(0);
    entry = kinegen_find_entry(name);
    if (entry == NULL || entry->arrays > MOST_ARRAYS) return PyBool_FromLong(0);
    is_inverse = strcmp(kind, "inverse") == 0;
    if (is_inverse && entry->inputs != 1) return PyBool_FromLong(0);
    quick = quick_of(self);
    for (int i = 0; i < 2; ++i) quick->params[i] = PyLong_AsVoidPtr(addresses[i]);
    if (PyErr_Occurred()) return NULL;
    quick->entry = entry;
    quick->nearest = is_inverse ? kinegen_find_entry("inverse_nearest") : NULL;
    quick->call = is_inverse ? call_inverse : call_kernel;
    return PyBool_FromLong(1);
}

PyObject *kinegen_with_calls(PyObject *module);

/* The module that cffi made, with three more functions. */
PyObject *kinegen_with_calls(PyObject *module)
{
    static PyMethodDef functions[] = {
        {"quick_class", quick_class, METH_O, NULL},
        {"quicken", quicken, METH_VARARGS, NULL},
        {"empty_large", empty_large, METH_VARARGS, NULL},
        {NULL, NULL, 0, NULL},
    };
    if (module != NULL && PyModule_AddFunctions(module, functions) != 0) PyErr_Clear();
    return module;
}
