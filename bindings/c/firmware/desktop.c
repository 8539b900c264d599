/* The fixture on the desktop. */
#include <stdio.h>

#include "fixture.h"

void platform_write(const char *text)
{
    fputs(text, stdout);
}

unsigned long platform_count(void)
{
    return 0;
}

void platform_paint_stack(void)
{
}

unsigned long platform_stack(void)
{
    return 0;
}

int main(void)
{
    return fixture_run() == 0 ? 0 : 1;
}
