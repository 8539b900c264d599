/* The fixture on a board. */
#include "fixture.h"

int main(void)
{
    return fixture_run();
}
