#include "base/memory.h"

#include <errno.h>
#include <limits.h>
#include <jansson.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { RESERVES = 4, RESERVE = 4096 };

// Jansson leaves out of an object what it has no memory for, and hardly a caller looks: once it had none it gets none,
// so that no text is made of half an object. Other allocators than malloc are left alone.
static atomic_bool json_stopped;
static _Atomic(void *) reserve[RESERVES]; // where a number's text cannot grow, jansson's parser aborts

// Jansson's texts double from 16 bytes on, and its values have other sizes: a parser does not go on for long.
static bool may_be_text(size_t size)
{
    return size > 16 && size <= RESERVE && (size & (size - 1)) == 0;
}

static void *json_malloc(size_t size)
{
    void *p = json_stopped ? NULL : malloc(size);
    if (p) return p;
    json_stopped = true;
    fs_error_memory(NULL);
    for (int i = 0; i < RESERVES && !p && may_be_text(size); i++) p = atomic_exchange(&reserve[i], NULL);
    return p;
}

unsigned fs_memory_begin(void)
{
    json_malloc_t allocate;
    json_free_t release;
    json_get_alloc_funcs(&allocate, &release);
    if (allocate == malloc && release == free) json_set_alloc_funcs(json_malloc, free);
    for (int i = 0; i < RESERVES; i++)
        if (!reserve[i]) reserve[i] = malloc(RESERVE);
    json_stopped = false;
    errno = 0;
    return fs_error_memory_failures();
}

int fs_memory_end(unsigned begun, int rc, FsError *err)
{
    return rc == 0 && fs_error_memory_failures() != begun ? fs_error_memory(err) : rc;
}

int fs_memory_grow(void *array, int n, size_t size, FsError *err)
{
    if (n > 0 && (n & (n - 1)) != 0) return 0;
    void *old, *grown;
    memcpy(&old, array, sizeof old);
    grown = n <= INT_MAX / 2 ? realloc(old, (n ? 2 * (size_t)n : 1) * size) : NULL;
    if (!grown) return fs_error_memory(err);
    memcpy(array, &grown, sizeof grown);
    return 0;
}
