/* Calibrates the built-in measurements with both calibrators, through gates, and from touches, distances and single
 * coordinates, in single and in double precision, and writes every bit that comes out. */
#include "fixture.h"

#include <string.h>

#include "delta_cal.h"
#include "measurements.h"

static int failures;

/* Hexadecimal digits of a number's bits, after a blank. */
static void write_bits(uint64_t bits, int digits)
{
    char text[18];
    text[0] = ' ';
    for (int digit = digits; digit > 0; digit--) {
        text[digit] = "0123456789abcdef"[bits & 15];
        bits >>= 4;
    }
    text[digits + 1] = 0;
    platform_write(text);
}

static void write_count(uint64_t count)
{
    char text[22];
    char *begin = &text[sizeof text - 1];
    *begin = 0;
    do {
        *--begin = (char)('0' + count % 10);
        count /= 10;
    } while (count > 0);
    *--begin = ' ';
    platform_write(begin);
}

/* What a call should come to. */
static void expect(dcal_status status, dcal_status expected, const char *call)
{
    if (status == expected) {
        return;
    }
    failures++;
    platform_write("FAILED ");
    platform_write(call);
    platform_write(": ");
    platform_write(dcal_status_text(status));
    platform_write("\n");
}

#define OK(call) expect((call), DCAL_OK, #call)

static void check(int holds, const char *what)
{
    if (!holds) {
        failures++;
        platform_write("FAILED ");
        platform_write(what);
        platform_write("\n");
    }
}

#define CHECK(what) check((what), #what)
#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)

/* Two snapshots, of the calibrator with the longest. */
static unsigned char bytes[2][DCAL_JOINT_GATE_SNAPSHOT_F64_SIZE];

static void write_error(const char *label, const dcal_error *error)
{
    uint32_t figure;
    memcpy(&figure, &error->figure, sizeof figure);
    platform_write("BITS ");
    platform_write(label);
    platform_write(":");
    write_count((uint64_t)error->status);
    write_count((uint64_t)(error->arm + 1));
    write_count((uint64_t)(error->parameter + 1));
    write_count(error->count);
    write_count(error->needed);
    write_bits(figure, 8);
    platform_write("\n");
}

#define REAL float
#define BITS uint32_t
#define OF(name) name##_f32
#define NAME "f32"
#include "fixture_scalar.h"
#undef REAL
#undef BITS
#undef OF
#undef NAME
#undef WRITE_FOUND
#undef SCALAR
#undef C
#undef OWN
#undef PLACE

#define REAL double
#define BITS uint64_t
#define OF(name) name##_f64
#define NAME "f64"
#include "fixture_scalar.h"

/* What the library says that an object takes fits what the header gives it. */
static void check_size(int32_t kind, size_t size)
{
    check(dcal_size(kind) > 0 && dcal_size(kind) <= size, "the header is not the library's: the size of an object");
}

static void check_sizes(void)
{
    check_size(DCAL_ROBOT_F32, sizeof(dcal_robot_f32));
    check_size(DCAL_IKM_F32, sizeof(dcal_ikm_f32));
    check_size(DCAL_JOINT_F32, sizeof(dcal_joint_f32));
    check_size(DCAL_GATE_F32, sizeof(dcal_gate_f32));
    check_size(DCAL_JOINT_GATE_F32, sizeof(dcal_joint_gate_f32));
    check_size(DCAL_FKM_F32, sizeof(dcal_fkm_f32));
    check(dcal_alignment() == 8, "the header is not the library's: the alignment of an object");
}

int fixture_run(void)
{
    check_sizes();
    check(dcal_version() == DCAL_VERSION, "the library is not of the header's version");
    run_f32();
    run_f64();
    return failures;
}
