/* Plain NumPy arrays to the arguments of a kernel: shapes, strides, types and overlap, read from the array headers.
 *
 * Part of the compiled Python module alone, never of the kernels that leave the house. Only the fields of the array
 * object are read, whose form NumPy has kept from version 1 to 2; no function of NumPy or Python is called, so this
 * needs no interpreter lock. The caller holds references to both arrays.
 */
#ifndef KINEGEN_ARRAYS_H_INCLUDED
#define KINEGEN_ARRAYS_H_INCLUDED

#include <stddef.h>
#include <stdint.h>
#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#include <Python.h>
#include <numpy/ndarraytypes.h>

/* More configurations than this are declined: the caller cuts the batch up, and Ctrl-C gets through in between. */
#define LARGEST_BLOCK 32768

/* Layouts of a result, as the batch kernels number them. */
enum { LAYOUT_4X4 = 0, LAYOUT_3X4 = 1, LAYOUT_JOINT_MAJOR = 2 };

/* What one output takes and gives for one configuration. */
typedef struct {
    npy_intp dof;
    int rank;          /* of the result: (4, 4), (tips, 4, 4), (3,) or (tips, 3) */
    npy_intp shape[3];
    int is_pose;
} Output;

/* The arguments of a call, in elements. */
typedef struct {
    int type;          /* NPY_DOUBLE or NPY_FLOAT */
    int single;        /* one contiguous configuration: the scalar kernel serves it */
    size_t count;
    const void *q;
    ptrdiff_t q_pose, q_joint;
    void *out;
    ptrdiff_t out_stride;
} Arguments;

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

/* Whether the axes from `lead` on have the extents that the output has in this layout. */
static int has_shape(PyArrayObject *out, int lead, const Output *output, int layout)
{
    npy_intp rows = 1;
    for (int i = 0; i < output->rank; ++i) rows *= output->shape[i];
    if (layout == LAYOUT_JOINT_MAJOR) {
        return PyArray_NDIM(out) == lead + 1 && PyArray_DIM(out, lead) == (output->is_pose ? rows / 4 * 3 : rows);
    }
    if (PyArray_NDIM(out) != lead + output->rank || (layout != LAYOUT_4X4 && !output->is_pose)) return 0;
    for (int i = 0; i < output->rank; ++i) {
        const int shorter = layout == LAYOUT_3X4 && i == output->rank - 2;
        if (PyArray_DIM(out, lead + i) != output->shape[i] - shorter) return 0;
    }
    return 1;
}

/* Whether two arrays can be told to be apart by where they begin and end. */
static int are_apart(PyArrayObject *first, PyArrayObject *second, npy_intp size)
{
    const char *low[2], *high[2];
    extent(first, size, &low[0], &high[0]);
    extent(second, size, &low[1], &high[1]);
    return high[0] <= low[1] || high[1] <= low[0];
}

/* Whether the numbers of an array can be read where they lie: at even addresses, in the order of this machine. The
 * byte order is read from its field, since NumPy's own macro needs functions of NumPy from 2.5 on. */
static int is_behaved(PyArrayObject *array, int flags)
{
    return PyArray_CHKFLAGS(array, NPY_ARRAY_ALIGNED | flags) && PyArray_ISNBO(PyArray_DESCR(array)->byteorder);
}

/* Fill in the arguments; 0 for arrays that the kernel cannot use where they lie. Poses are the leading axes. */
static int read_arrays(uintptr_t q_address, uintptr_t out_address, int layout, const Output *output, Arguments *found)
{
    PyArrayObject *const q = (PyArrayObject *)q_address, *const out = (PyArrayObject *)out_address;
    const int lead = PyArray_NDIM(q) - 1, type = PyArray_TYPE(q);
    const npy_intp size = type == NPY_DOUBLE ? (npy_intp)sizeof(double) : (npy_intp)sizeof(float);
    npy_intp count = 1, q_pose, out_pose;

    /* Types and shapes. */
    if ((type != NPY_DOUBLE && type != NPY_FLOAT) || type != PyArray_TYPE(out)) return 0;
    if (!is_behaved(q, 0) || !is_behaved(out, NPY_ARRAY_WRITEABLE)) return 0;
    if (lead < 0 || PyArray_DIM(q, lead) != output->dof || !has_shape(out, lead, output, layout)) return 0;
    for (int i = 0; i < lead; ++i) {
        if (PyArray_DIM(q, i) != PyArray_DIM(out, i)) return 0;
        count *= PyArray_DIM(q, i);
    }

    if (count > LARGEST_BLOCK) return 0;

    /* Strides, in bytes until here, in elements from here on. */
    if (!merge(q, lead, size, &q_pose) && output->dof != 0) return 0; /* nothing is read of an array without elements */
    if (!merge(out, lead, size, &out_pose)) return 0;
    if (PyArray_STRIDE(q, lead) % size != 0 && output->dof != 0) return 0;
    found->type = type;
    found->count = (size_t)count;
    found->q = PyArray_DATA(q);
    found->q_pose = q_pose / size;
    found->q_joint = PyArray_STRIDE(q, lead) / size;
    found->out = PyArray_DATA(out);
    if (layout == LAYOUT_JOINT_MAJOR) {
        if ((count > 1 && out_pose != size) || PyArray_STRIDE(out, lead) % size != 0) return 0;
        found->out_stride = PyArray_STRIDE(out, lead) / size;
    } else {
        if (!is_dense(out, lead, size)) return 0;
        found->out_stride = out_pose / size;
    }

    /* A single configuration goes to the scalar kernel, or is declined, so that its bits never depend on the way. */
    found->single = lead == 0 && layout == LAYOUT_4X4;
    if (output->dof == 0) return 1;
    if (found->single && !is_dense(q, lead, size)) return 0;
    return count == 0 || are_apart(q, out, size);
}

#endif
