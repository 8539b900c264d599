/* Start, faults and output of a program under QEMU: replace this file by your part's. */
#include <stddef.h>
#include <stdint.h>

#include "fixture.h"

extern uint32_t stack_top[], stack_begin[];
extern uint32_t data_begin[], data_end[], data_source[];
extern uint32_t bss_begin[], bss_end[];

int main(void);
void reset(void);

enum { OPEN = 0x01, WRITE = 0x05, EXIT_EXTENDED = 0x20, STOPPED_BY_APPLICATION = 0x20026 };

/* A request to the emulator. */
static uint32_t semihosting(uint32_t request, const uint32_t *block)
{
    register uint32_t number __asm__("r0") = request;
    register const uint32_t *argument __asm__("r1") = block;
    __asm__ volatile("bkpt 0xab" : "+r"(number) : "r"(argument) : "memory");
    return number;
}

/* Collected: each request stops the processor. */
static char buffer[1024];
static size_t length;

static void flush(void)
{
    static uint32_t output;
    if (output == 0) {
        /* The console, for writing. */
        const uint32_t console[3] = {(uint32_t)(uintptr_t)":tt", 4, 3};
        output = semihosting(OPEN, console);
    }
    const uint32_t block[3] = {output, (uint32_t)(uintptr_t)buffer, length};
    semihosting(WRITE, block);
    length = 0;
}

void platform_write(const char *text)
{
    while (*text) {
        if (length == sizeof buffer) {
            flush();
        }
        buffer[length++] = *text++;
    }
}

static void leave(uint32_t code)
{
    const uint32_t block[2] = {STOPPED_BY_APPLICATION, code};
    flush();
    for (;;) {
        semihosting(EXIT_EXTENDED, block);
    }
}

static void fault(void)
{
    /* The stack may be what has failed. */
    __asm__ volatile("mov sp, %0" : : "r"(stack_top) : "memory");
    platform_write("FAILED a fault, or an interrupt without a handler\n");
    leave(1);
}

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xe000e010)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xe000e014)
#define SYSTICK_VALUE (*(volatile uint32_t *)0xe000e018)
#define COPROCESSORS (*(volatile uint32_t *)0xe000ed88)

static volatile uint32_t turns;

/* The timer has counted down its 24 bits. */
static void turn(void)
{
    turns = turns + 1;
}

/* Under `-icount shift=6` eight ticks of the timer are five instructions. */
unsigned long platform_count(void)
{
    uint32_t before;
    uint32_t value;
    do {
        before = turns;
        value = SYSTICK_VALUE;
    } while (turns != before);
    const uint64_t ticks = ((uint64_t)before << 24) + (0xffffff - value);
    return (unsigned long)(ticks * 5 / 8);
}

#define STACK_PAINT 0xa5c35a3cu

void platform_paint_stack(void)
{
    const uint32_t *here = __builtin_frame_address(0);
    for (volatile uint32_t *word = stack_begin; word < here - 64; word++) {
        *word = STACK_PAINT;
    }
}

unsigned long platform_stack(void)
{
    const uint32_t *here = __builtin_frame_address(0);
    const volatile uint32_t *word = stack_begin;
    while (word < here && *word == STACK_PAINT) {
        word++;
    }
    return (unsigned long)((uintptr_t)here - (uintptr_t)word);
}

void reset(void)
{
    /* The floating-point unit, where there is one; before any instruction of it. */
    COPROCESSORS |= 0xfu << 20;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    const uint32_t *source = data_source;
    for (uint32_t *word = data_begin; word < data_end; word++) {
        *word = *source++;
    }
    for (volatile uint32_t *word = bss_begin; word < bss_end; word++) {
        *word = 0;
    }
    SYSTICK_RELOAD = 0xffffff;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 7;
    leave(main() == 0 ? 0 : 1);
}

/* The initial stack and the handlers, as the processor finds them at its start. */
struct vectors {
    uint32_t *stack;
    void (*handlers[15])(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    stack_top,
    {
        reset,
        fault,
        fault,
        fault,
        fault,
        fault,
        NULL,
        NULL,
        NULL,
        NULL,
        fault,
        fault,
        NULL,
        fault,
        turn,
    },
};
