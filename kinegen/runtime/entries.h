/* What the C of a robot and the C that is the same for all robots tell each other: kernels, and the arrays of a call.
 *
 * Part of the compiled Python module alone. Nothing here needs the headers of Python or NumPy.
 */
#ifndef KINEGEN_KINEGEN_ENTRIES_H_INCLUDED
#define KINEGEN_KINEGEN_ENTRIES_H_INCLUDED

#include <stddef.h>
#include <stdint.h>

/* Number types, as NumPy numbers them. */
enum { TYPE_FLOAT = 11, TYPE_DOUBLE = 12 };

/* Layouts of a result, as the batch kernels number them. */
enum { LAYOUT_4X4 = 0, LAYOUT_3X4 = 1, LAYOUT_JOINT_MAJOR = 2 };

/* One array of a kernel for one configuration: (6), (4, 4), (tips, 4, 4), (6, 7) and so on. */
typedef struct {
    int rank;
    ptrdiff_t shape[4];
    int is_pose;       /* whether it holds matrices, whose last rows some layouts leave out */
    int is_empty;      /* whether it has no elements: a vector of no joints, a Jacobian by none */
    int is_truth;      /* whether it holds truth values, a byte each, whatever the numbers of the others are */
} Form;

/* Where an array of a call lies, with strides in elements. */
typedef struct {
    void *data;
    ptrdiff_t pose;    /* from one configuration to the next; for results in joint-major layout from row to row */
    ptrdiff_t joint;   /* from one number to the next */
} Place;

/* What a call is. */
typedef struct {
    int type;          /* TYPE_DOUBLE or TYPE_FLOAT */
    int single;        /* one contiguous configuration: the scalar kernel serves it */
    size_t count;
    ptrdiff_t sets;    /* from the parameters of one configuration to those of the next, in structs; 0 is one for all */
} Call;

/* One kernel: its arrays, inputs first, and what evaluates it where `kinegen_read_arrays` found them; 0 for a missing type. */
typedef struct {
    const char *name;
    int inputs, arrays;
    const Form *forms;
    int (*run)(const void *const *params, const Place *places, const Call *call, int layout);
} Entry;

/* Find where the arrays of a call lie, inputs first; 0 for arrays that the kernel cannot use where they lie. */
int kinegen_read_arrays(const uintptr_t *addresses, const Form *forms, int inputs, int arrays, int layout, Place *places,
                        Call *call);

/* Find the parameters of each configuration of a call, which lie in the rows of an array (configurations, parameters) of
 * the same type; NULL for an array that is something else. */
const void *kinegen_take_sets(uintptr_t address, ptrdiff_t parameters, Call *call);

/* The kernel of the robot that has a name, or NULL. */
const Entry *kinegen_find_entry(const char *name);

#endif
