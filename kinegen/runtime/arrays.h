/* Plain NumPy arrays to the arguments of a kernel: shapes, strides, types and overlap, read from the array headers.
 *
 * Part of the compiled Python module alone, never of the kernels that leave the house. Only the fields of the array
 * object are read, whose form NumPy has kept from version 1 to 2; no function of NumPy or Python is called, so this
 * needs no interpreter lock. The caller holds references to both arrays.
 */
#ifndef KINEGEN_KINEGEN_ARRAYS_H_INCLUDED
#define KINEGEN_KINEGEN_ARRAYS_H_INCLUDED

#include "kinegen_entries.h"
#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#include <Python.h>
#include <numpy/ndarraytypes.h>

/* More configurations than this are declined: the caller cuts the batch up, and Ctrl-C gets through in between. */
#define LARGEST_BLOCK 32768

/* The type of the entries of an array in a call with numbers of a type. */
static int entry_type(const Form *form, int type)
{
    return form->is_truth ? NPY_BOOL : type;
}

/* Bytes of such an entry. */
static npy_intp bytes_of(const Form *form, int type)
{
    return form->is_truth ? 1 : type == NPY_DOUBLE ? (npy_intp)sizeof(double) : (npy_intp)sizeof(float);
}

/* The first and the last byte that an array touches, the last one exclusive. */
static void extent(PyArrayObject *array, npy_intp size, const char **low, const char **high)
{
    *low = PyArray_BYTES(array);
    *high = *low + size;
    for (int i = 0; i < PyArray_NDIM(array); ++i) {
        const npy_intp reach = (PyArray_DIM(array, i) - 1) * PyArray_STRIDE(array, i);
        if (reach < 0) *low += reach; else *high += reach;
    }
}

/* Merge the leading axes into one and find its stride; 0 where the strides do not allow it. */
static int merge(PyArrayObject *array, int lead, npy_intp size, npy_intp *stride)
{
    npy_intp expected = 0;
    int found = 0;
    *stride = 0;
    for (int i = lead - 1; i >= 0; --i) {
        const npy_intp length = PyArray_DIM(array, i), step = PyArray_STRIDE(array, i);
        if (length == 1) continue;
        if (!found) *stride = step;
        else if (step != expected) return 0;
        found = 1;
        expected = step * length;
    }
    return *stride % size == 0;
}

/* Whether the axes from `lead` on lie next to each other, the last one closest. */
static int is_dense(PyArrayObject *array, int lead, npy_intp size)
{
    npy_intp expected = size;
    for (int i = PyArray_NDIM(array) - 1; i >= lead; --i) {
        if (PyArray_DIM(array, i) != 1 && PyArray_STRIDE(array, i) != expected) return 0;
        expected *= PyArray_DIM(array, i);
    }
    return 1;
}

/* The number of axes of one configuration in a layout. */
static int inner_rank(const Form *form, int layout)
{
    return layout == LAYOUT_JOINT_MAJOR ? 1 : form->rank;
}

/* Whether the axes from `lead` on have the extents that the array has in this layout. */
static int has_shape(PyArrayObject *array, int lead, const Form *form, int layout)
{
    npy_intp rows = 1;
    if (PyArray_NDIM(array) != lead + inner_rank(form, layout)) return 0;
    if (layout == LAYOUT_JOINT_MAJOR) {
        for (int i = 0; i < form->rank; ++i) rows *= form->shape[i];
        return PyArray_DIM(array, lead) == (form->is_pose ? rows / 4 * 3 : rows);
    }
    for (int i = 0; i < form->rank; ++i) {
        const int shorter = layout == LAYOUT_3X4 && form->is_pose && i == form->rank - 2;
        if (PyArray_DIM(array, lead + i) != form->shape[i] - shorter) return 0;
    }
    return 1;
}

/* Whether two arrays, each with the bytes of its entries, can be told to be apart by where they begin and end. */
static int are_apart(PyArrayObject *first, npy_intp first_size, PyArrayObject *second, npy_intp second_size)
{
    const char *low[2], *high[2];
    extent(first, first_size, &low[0], &high[0]);
    extent(second, second_size, &low[1], &high[1]);
    return high[0] <= low[1] || high[1] <= low[0];
}

/* Whether the numbers of an array can be read where they lie: at even addresses, in the order of this machine. The
 * byte order is read from its field, since NumPy's own macro needs functions of NumPy from 2.5 on. */
static int is_behaved(PyArrayObject *array, int flags)
{
    return PyArray_CHKFLAGS(array, NPY_ARRAY_ALIGNED | flags) && PyArray_ISNBO(PyArray_DESCR(array)->byteorder);
}

/* Whether a step of this many bytes stays within an entry of that size, so that entries lie over each other. */
static int is_within(npy_intp step, npy_intp size)
{
    return -size < step && step < size;
}

/* Bytes of what one configuration has in an array. */
static npy_intp entry_size(PyArrayObject *array, int lead, npy_intp size)
{
    for (int i = lead; i < PyArray_NDIM(array); ++i) size *= PyArray_DIM(array, i);
    return size;
}

/* Find where an array lies, if the kernel can use it there. Poses are the leading axes. */
static int find_place(PyArrayObject *array, int lead, npy_intp count, npy_intp size, int is_result, int layout, Place *found)
{
    const int vector = PyArray_NDIM(array) == lead + 1;
    npy_intp pose;
    found->data = PyArray_DATA(array);
    if (!merge(array, lead, size, &pose)) return 0;
    found->pose = pose / size;
    found->joint = 1;
    if (is_result && layout == LAYOUT_JOINT_MAJOR) {
        const npy_intp row = PyArray_STRIDE(array, lead);
        if ((count > 1 && pose != size) || row % size != 0) return 0;
        if (PyArray_DIM(array, lead) > 1 && is_within(row, count * size)) return 0;
        found->pose = PyArray_STRIDE(array, lead) / size;
        return 1;
    }
    if (is_result && count > 1 && is_within(pose, entry_size(array, lead, size))) return 0;
    if (is_result || !vector) return is_dense(array, lead, size);
    if (PyArray_STRIDE(array, lead) % size != 0) return 0;
    found->joint = PyArray_STRIDE(array, lead) / size;
    return 1;
}

/* Whether an array has the type, the leading axes and the shape that the others and the kernel have. */
static int fits(PyArrayObject *array, PyArrayObject *first, int lead, const Form *form, int is_result, int layout)
{
    if (PyArray_TYPE(array) != entry_type(form, PyArray_TYPE(first))) return 0;
    if (!is_behaved(array, is_result ? NPY_ARRAY_WRITEABLE : 0)) return 0;
    if (!has_shape(array, lead, form, layout)) return 0;
    for (int i = 0; i < lead; ++i) {
        if (PyArray_DIM(array, i) != PyArray_DIM(first, i)) return 0;
    }
    return 1;
}

int kinegen_read_arrays(const uintptr_t *addresses, const Form *forms, int inputs, int arrays, int layout, Place *places,
                        Call *call)
{
    PyArrayObject *const first = (PyArrayObject *)addresses[0];
    const int lead = PyArray_NDIM(first) - inner_rank(&forms[0], layout), type = PyArray_TYPE(first);
    npy_intp count = 1;

    if (lead < 0 || (type != NPY_DOUBLE && type != NPY_FLOAT)) return 0;
    for (int i = 0; i < lead; ++i) count *= PyArray_DIM(first, i);
    if (count > LARGEST_BLOCK) return 0;
    call->type = type;
    call->sets = 0;
    call->count = (size_t)count;
    /* A single configuration goes to the scalar kernel, or is declined, so that its bits never depend on the way. */
    call->single = lead == 0 && layout == LAYOUT_4X4;
    for (int i = 0; i < arrays; ++i) {
        PyArrayObject *const array = (PyArrayObject *)addresses[i];
        const int is_result = i >= inputs;
        const npy_intp size = bytes_of(&forms[i], type);
        if (!fits(array, first, lead, &forms[i], is_result, layout)) return 0;
        if (forms[i].is_empty) { /* nothing is read or written */
            places[i] = (Place){PyArray_DATA(array), 0, 0};
            continue;
        }
        if (!find_place(array, lead, count, size, is_result, layout, &places[i])) return 0;
        if (call->single && !is_dense(array, lead, size)) return 0;
        for (int other = 0; is_result && count != 0 && other < i; ++other) {
            PyArrayObject *const before = (PyArrayObject *)addresses[other];
            if (!forms[other].is_empty && !are_apart(before, bytes_of(&forms[other], type), array, size)) return 0;
        }
    }
    return 1;
}

const void *kinegen_take_sets(uintptr_t address, ptrdiff_t parameters, Call *call)
{
    PyArrayObject *const array = (PyArrayObject *)address;
    if (PyArray_NDIM(array) != 2 || PyArray_TYPE(array) != call->type) return NULL;
    if (PyArray_DIM(array, 0) != (npy_intp)call->count || PyArray_DIM(array, 1) != parameters) return NULL;
    if (!is_behaved(array, NPY_ARRAY_C_CONTIGUOUS)) return NULL;
    call->sets = 1;
    call->single = 0;
    return PyArray_DATA(array);
}

#endif
