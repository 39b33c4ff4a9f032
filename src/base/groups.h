// Things joined into groups (union-find): parent[i] is another one of the group of i, or i itself for one of them,
// which stands for the group.
#pragma once

static inline int fs_group_of(int *parent, int i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

// The group of b becomes part of the group of a.
static inline void fs_group_join(int *parent, int a, int b)
{
    parent[fs_group_of(parent, b)] = fs_group_of(parent, a);
}
