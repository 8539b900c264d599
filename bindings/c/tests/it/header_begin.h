/** delta_cal.h: kinematic calibration of Delta parallel robots, for C99 and C++11.
 *
 * Made from the library's source; do not edit it. The manual is docs/c.md.
 *
 * Angles are in radians, lengths in any one unit that you choose. Names end in _f32 or _f64, the type of all numbers.
 *
 * Objects lie in memory that you provide: a variable of the object's type, wherever you like, static or on the stack.
 * Nothing is allocated, nothing is released, and an object holds no pointer, so that you may copy one by assignment.
 * Functions that make an object take its size (sizeof object) and refuse less than they need. An object is of this
 * version of the library: after an update of the firmware, make it anew from a snapshot.
 *
 * Every function but four returns DCAL_OK (0), DCAL_WORKING (1), or why nothing was done. A call that
 * fails writes nothing but its error. An argument `error` may be NULL. What every function can return beside the
 * errors that stand with it: DCAL_NULL_POINTER, DCAL_MISALIGNED, DCAL_WRONG_SIZE,
 * DCAL_NOT_INITIALIZED, DCAL_WRONG_KIND and DCAL_OVERLAP.
 *
 * What you promise: a pointer is NULL or leads to memory of its type, and nobody else uses that memory during the
 * call. Different objects may be used at the same time, from interrupts and threads too.
 */
#ifndef DELTA_CAL_H
#define DELTA_CAL_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus)
#define DCAL_ASSERT(condition, text) static_assert(condition, text)
#define DCAL_ALIGNED alignas(8)
extern "C" {
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define DCAL_ASSERT(condition, text) _Static_assert(condition, text)
#define DCAL_ALIGNED _Alignas(8)
#else
#define DCAL_ASSERT(condition, text) extern int dcal_asserted[(condition) ? 1 : -1]
#ifdef __GNUC__
#define DCAL_ALIGNED __attribute__((aligned(8)))
#else
#define DCAL_ALIGNED /* Align objects to 8 bytes yourself: DCAL_MISALIGNED says where they are not. */
#endif
#endif
#define DCAL_OBJECT(type, size) DCAL_ASSERT(sizeof(type) == size, "the size of an object")
