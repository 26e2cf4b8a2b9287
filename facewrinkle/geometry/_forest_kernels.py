"""Machine code for the forest of red splits: three integer tables, and the loops that grow, prune and read it.

A *node* is a triangle that the forest knows: the M0 triangles are rows 0 to m0 - 1, and the four children of
a node that is split red are four consecutive rows after them. Side `s` of a node runs from its vertex `s` to
its vertex `s + 1`. An *edge* belongs to the nodes of one level; once one of them is split, it has a midpoint
and two halves in consecutive rows. All nodes on an edge hang in a linked list, so that any number of
triangles can meet there. Every column is paid for a million times, so a row holds nothing that its family knows.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from .compilation import compiled

# Columns of a node. FACE links the list of its edge (three sides each). CHILD of a leaf is NONE, or links the worklist:
# LAST_QUEUED, or NEXT_QUEUED - y before leaf y. FLAGS holds the level from bit LEVEL on, and bit s is set if side s has
# a midpoint. FAMILY is the parent in the first of four siblings, their M0 triangle in the second; no row of M0 has one.
VERTEX, EDGE, FACE, CHILD, FLAGS, FAMILY, NODE_WIDTH = 0, 3, 6, 9, 10, 11, 12
NONE, LAST_QUEUED, NEXT_QUEUED = -1, -2, -3
HANGING, LEVEL = 7, 3
# Columns of an edge: ends, midpoint, first half, the edge it is half of, how many of its nodes are split, its
# list of sides (3 node + side), and the M0 triangle that hosts its midpoint.
END, MIDPOINT, HALF, WHOLE, N_SPLIT, SIDES, HOST, EDGE_WIDTH = 0, 2, 3, 4, 5, 6, 7, 8
# Columns of a vertex: the two vertices it is the midpoint of, host, level.
OF, POINT_HOST, POINT_LEVEL, POINT_WIDTH = 0, 2, 3, 4
# Entries of the state: rows in use, the number of M0 triangles, heads of the lists of free rows (linked by FAMILY and
# WHOLE), the ends of the worklist and the number of its entries.
N_NODES, N_EDGES, N_POINTS, N_ROOTS, FREE_NODES, FREE_HALVES, FREE_INNER, FIRST, LAST, COUNT = range(10)
STATE_WIDTH = 10
# Status of a split node while the mesh is coarsened: not decided, stays split, or is to become a leaf; then, whether it
# waits to be looked at.
UNKNOWN, SPLIT, TAKEN, WAITING = 0, 1, 2, 3
# The most rows that one red split adds: 4 nodes; 3 pairs of halves and 3 inner edges; 3 midpoints.
ROOM = 9

# Row numbers are widened to int64 where they are passed on, so that numba compiles every helper only once; small ones
# become part of what calls them.


@compiled
def _hang(nodes, edges, x, s):
    """Put side s of node x into the list of its edge."""
    e = nodes[x, EDGE + s]
    nodes[x, FACE + s] = edges[e, SIDES]
    edges[e, SIDES] = 3 * x + s
    if edges[e, MIDPOINT] >= 0:
        nodes[x, FLAGS] |= 1 << s


@compiled
def _push(nodes, state, x):
    """Put leaf x at the end of the worklist, if it is not in it."""
    if nodes[x, CHILD] == NONE:
        nodes[x, CHILD] = LAST_QUEUED
        if state[COUNT] == 0:
            state[FIRST] = x
        else:
            nodes[state[LAST], CHILD] = NEXT_QUEUED - x
        state[LAST] = x
        state[COUNT] += 1


@compiled(inline="always")
def _take(table, link, state, free, used, count):
    """Return the first of `count` consecutive rows: freed ones, or new ones at the end."""
    row = state[free]
    if row >= 0:
        state[free] = table[row, link]
    else:
        row = state[used]
        state[used] += count
    return row


@compiled(inline="always")
def _new_node(nodes, x, a, b, c, level):
    nodes[x, VERTEX], nodes[x, VERTEX + 1], nodes[x, VERTEX + 2] = a, b, c
    nodes[x, CHILD], nodes[x, FLAGS] = NONE, level << LEVEL


@compiled(inline="always")
def _new_edge(edges, e, a, b, whole, host):
    edges[e, END], edges[e, END + 1], edges[e, MIDPOINT], edges[e, HALF] = a, b, NONE, NONE
    edges[e, WHOLE], edges[e, N_SPLIT], edges[e, SIDES], edges[e, HOST] = whole, 0, NONE, host


@compiled
def plant(nodes, edges, points, ends, sides, triangles):
    """Fill the first rows of the tables with the M0 triangles."""
    for e in range(len(ends)):
        _new_edge(edges, e, ends[e, 0], ends[e, 1], NONE, NONE)
    for v in range(len(points)):
        points[v, OF], points[v, OF + 1], points[v, POINT_HOST], points[v, POINT_LEVEL] = NONE, NONE, NONE, 0
    # Backwards, so that the lists are ascending and the lowest triangle is host.
    for t in range(len(triangles) - 1, -1, -1):
        _new_node(nodes, t, triangles[t, 0], triangles[t, 1], triangles[t, 2], 0)
        for s in range(3):
            nodes[t, EDGE + s] = sides[t, s]
            _hang(nodes, edges, t, s)
            edges[sides[t, s], HOST] = t
            points[triangles[t, s], POINT_HOST] = t


@compiled
def _must_split(nodes, edges, x):
    """Return True if leaf x has midpoints on two sides, or a neighbor two levels finer."""
    hanging = nodes[x, FLAGS] & HANGING
    if hanging & (hanging - 1):
        return True
    for s in range(3):
        if hanging >> s & 1:
            half = edges[nodes[x, EDGE + s], HALF]
            return edges[half, MIDPOINT] >= 0 or edges[half + 1, MIDPOINT] >= 0
    return False


@compiled
def _push_illegal(nodes, edges, state, e):
    side = edges[e, SIDES]
    while side >= 0:
        x = np.int64(side // 3)
        if nodes[x, CHILD] < 0 and _must_split(nodes, edges, x):
            _push(nodes, state, x)
        side = nodes[x, FACE + side % 3]


@compiled
def _bisect(nodes, edges, points, state, e, level):
    """Give edge e a midpoint and two halves, and queue the leaves that cannot stay leaves with it."""
    mid = state[N_POINTS]
    state[N_POINTS] += 1
    a, b, host = np.int64(edges[e, END]), np.int64(edges[e, END + 1]), edges[e, HOST]
    points[mid, OF], points[mid, OF + 1] = a, b
    points[mid, POINT_HOST], points[mid, POINT_LEVEL] = host, level + 1
    half = _take(edges, WHOLE, state, FREE_HALVES, N_EDGES, 2)
    _new_edge(edges, half, a, mid, e, host)
    _new_edge(edges, half + 1, mid, b, e, host)
    edges[e, MIDPOINT], edges[e, HALF] = mid, half
    side = edges[e, SIDES]
    while side >= 0:
        nodes[side // 3, FLAGS] |= 1 << side % 3
        side = nodes[side // 3, FACE + side % 3]
    _push_illegal(nodes, edges, state, e)
    if edges[e, WHOLE] >= 0:
        _push_illegal(nodes, edges, state, np.int64(edges[e, WHOLE]))


@compiled
def _parent(nodes, state, x):
    eldest = x - (x - state[N_ROOTS]) % 4
    return NONE if x < state[N_ROOTS] else nodes[eldest, FAMILY]


@compiled
def _split_red(nodes, edges, points, state, x):
    child = _take(nodes, FAMILY, state, FREE_NODES, N_NODES, 4)
    inner = _take(edges, WHOLE, state, FREE_INNER, N_EDGES, 3)
    nodes[x, CHILD] = child
    level, root = nodes[x, FLAGS] >> LEVEL, x
    if x >= state[N_ROOTS]:
        root = np.int64(nodes[x - (x - state[N_ROOTS]) % 4 + 1, FAMILY])
    nodes[child, FAMILY], nodes[child + 1, FAMILY] = x, root
    for s in range(3):
        e = np.int64(nodes[x, EDGE + s])
        if edges[e, MIDPOINT] < 0:
            _bisect(nodes, edges, points, state, e, level)
        edges[e, N_SPLIT] += 1
    for s in range(3):
        v = nodes[x, VERTEX + s]
        right, left = nodes[x, EDGE + s], nodes[x, EDGE + (s + 2) % 3]
        p, q = edges[right, MIDPOINT], edges[left, MIDPOINT]
        _new_edge(edges, inner + s, p, q, NONE, root)
        _new_node(nodes, child + s, v, p, q, level + 1)
        nodes[child + s, EDGE] = edges[right, HALF] + (edges[right, END] != v)
        nodes[child + s, EDGE + 1] = inner + s
        nodes[child + s, EDGE + 2] = edges[left, HALF] + (edges[left, END] != v)
    centre, p, q, r = child + 3, edges[inner, END], edges[inner + 1, END], edges[inner + 2, END]
    _new_node(nodes, centre, p, q, r, level + 1)
    for s in range(3):
        nodes[centre, EDGE + s] = inner + (s + 1) % 3
    # The children never have to be split in the same call: two hanging sides, or a neighbor two levels
    # finer, would need midpoints on two sides of x, or on a half of one, from before the call, and then x
    # would not have been a leaf.
    for node in range(child, child + 4):
        for s in range(3):
            _hang(nodes, edges, node, s)


@compiled
def grow(nodes, edges, points, state, marked, max_level):
    """Split the marked leaves and all that must follow; return False if the tables are full and must grow first."""
    for i in range(len(marked)):
        x = np.int64(marked[i])
        if nodes[x, FLAGS] >> LEVEL < max_level:
            _push(nodes, state, x)
    while state[COUNT] > 0:
        if (
            state[N_NODES] + ROOM > len(nodes)
            or state[N_EDGES] + ROOM > len(edges)
            or state[N_POINTS] + ROOM > len(points)
        ):
            return False
        x = state[FIRST]
        state[FIRST] = NEXT_QUEUED - nodes[x, CHILD]
        state[COUNT] -= 1
        nodes[x, CHILD] = NONE
        _split_red(nodes, edges, points, state, x)
    return True


@compiled
def _candidates(nodes, state, leaf, marked, status, found):
    """List the nodes whose four children are leaves and all marked, both green halves; return their number."""
    for i in range(len(leaf)):
        parent = _parent(nodes, state, leaf[i])
        if not marked[i] and parent >= 0:
            status[parent] = SPLIT
    count = 0
    for i in range(len(leaf)):
        x = _parent(nodes, state, leaf[i])
        if x >= 0 and status[x] == UNKNOWN:
            c = nodes[x, CHILD]
            status[x] = TAKEN
            for child in range(c, c + 4):
                if nodes[child, CHILD] >= 0:
                    status[x] = SPLIT
            if status[x] == TAKEN:
                found[count] = x
                count += 1
    return count


@compiled
def _may_close(nodes, edges, x):
    """Return True if node x would be a legal leaf, by the numbers of split nodes on its edges."""
    hanging = 0
    for s in range(3):
        e = nodes[x, EDGE + s]
        if edges[e, N_SPLIT] > 0:
            hanging += 1
            half = edges[e, HALF]
            if edges[half, N_SPLIT] > 0 or edges[half + 1, N_SPLIT] > 0:
                return False
    return hanging < 2


@compiled
def _wait_for(nodes, edges, status, waiting, count, e):
    """Put the nodes on edge e that are taken on the pile of those to look at; return their number on it."""
    side = edges[e, SIDES]
    while side >= 0:
        x = np.int64(side // 3)
        if status[x] == TAKEN:
            status[x] = WAITING
            waiting[count] = x
            count += 1
        side = nodes[x, FACE + side % 3]
    return count


@compiled
def _reopen_illegal(nodes, edges, status, found, waiting):
    """Close all candidates at once, then reopen those that cannot be leaves, until nothing changes."""
    count = len(found)
    for i in range(count):
        x = np.int64(found[i])
        status[x], waiting[i] = WAITING, x
        for s in range(3):
            edges[nodes[x, EDGE + s], N_SPLIT] -= 1
    while count > 0:
        count -= 1
        x = np.int64(waiting[count])
        status[x] = TAKEN
        if not _may_close(nodes, edges, x):
            status[x] = SPLIT
            for s in range(3):
                e = np.int64(nodes[x, EDGE + s])
                edges[e, N_SPLIT] += 1
                if edges[e, N_SPLIT] == 1:
                    count = _wait_for(nodes, edges, status, waiting, count, e)
                    if edges[e, WHOLE] >= 0:
                        count = _wait_for(nodes, edges, status, waiting, count, np.int64(edges[e, WHOLE]))


@compiled(inline="always")
def _free(table, row, count, link, state, free):
    for i in range(row, row + count):
        for j in range(table.shape[1]):
            table[i, j] = 0  # vertex 0 lives for ever, so free rows survive any renumbering of the vertices
    table[row, link] = state[free]
    state[free] = row


@compiled
def _close(nodes, edges, state, x):
    """Make node x a leaf."""
    child = np.int64(nodes[x, CHILD])
    for s in range(3):
        for outer in range(0, 3, 2):
            gone, e = 3 * (child + s) + outer, nodes[child + s, EDGE + outer]
            after = nodes[child + s, FACE + outer]
            side = edges[e, SIDES]
            if side == gone:
                edges[e, SIDES] = after
                continue
            while nodes[side // 3, FACE + side % 3] != gone:
                side = nodes[side // 3, FACE + side % 3]
            nodes[side // 3, FACE + side % 3] = after
    _free(edges, nodes[child, EDGE + 1], 3, WHOLE, state, FREE_INNER)
    _free(nodes, child, 4, FAMILY, state, FREE_NODES)
    nodes[x, CHILD] = NONE


@compiled
def prune(nodes, edges, state, leaf, marked, status, found, waiting, gone):
    """Remove sibling leaves where all four are marked, and set `gone` for the vertices that vanish.

    `status` (UNKNOWN for every node), `found` and `waiting` (room for a quarter of the leaves each) are scratch space.
    """
    found = found[: _candidates(nodes, state, leaf, marked, status, found)]
    _reopen_illegal(nodes, edges, status, found, waiting)
    for i in range(len(found)):
        if status[found[i]] == TAKEN:
            _close(nodes, edges, state, np.int64(found[i]))
    for i in range(len(found)):  # only now have the halves lost all their nodes
        if status[found[i]] == TAKEN:
            for s in range(3):
                e = nodes[found[i], EDGE + s]
                if edges[e, N_SPLIT] == 0 and edges[e, MIDPOINT] >= 0:
                    gone[edges[e, MIDPOINT]] = True
                    _free(edges, edges[e, HALF], 2, WHOLE, state, FREE_HALVES)
                    edges[e, MIDPOINT], edges[e, HALF] = NONE, NONE
                    side = edges[e, SIDES]
                    while side >= 0:
                        nodes[side // 3, FLAGS] &= ~(1 << side % 3)
                        side = nodes[side // 3, FACE + side % 3]


@compiled
def read_leaves(nodes, edges, n_roots, triangles, leaf):
    """Write the leaves, depth first from every root, with green halves; return the number of triangles."""
    m = 0
    for root in range(n_roots):
        x = root
        while True:
            while nodes[x, CHILD] >= 0:
                x = nodes[x, CHILD]
            hanging = nodes[x, FLAGS] & HANGING
            a, b, c = nodes[x, VERTEX], nodes[x, VERTEX + 1], nodes[x, VERTEX + 2]
            if hanging:
                s = hanging >> 1  # the only bit: 1, 2, 4 -> side 0, 1, 2
                mid = edges[nodes[x, EDGE + s], MIDPOINT]
                if s == 1:
                    a, b, c = b, c, a
                elif s == 2:
                    a, b, c = c, a, b
                triangles[m, 0], triangles[m, 1], triangles[m, 2], leaf[m] = a, mid, c, x
                m += 1
                a = mid
            triangles[m, 0], triangles[m, 1], triangles[m, 2], leaf[m] = a, b, c, x
            m += 1
            while x >= n_roots and (x - n_roots) % 4 == 3:
                x = nodes[x - 3, FAMILY]
            if x < n_roots:
                break
            x += 1
    return m


@compiled
def weigh(points, triangles0, corners, barycentric, first):
    """Give each vertex from `first` on the mean of the barycentric coordinates of the two it is the midpoint of."""
    for v in range(first, len(corners)):
        for k in range(3):
            corner = triangles0[points[v, POINT_HOST], k]
            total = 0.0
            for i in range(2):
                p = points[v, OF + i]
                for j in range(3):
                    if corners[p, j] == corner:
                        total += barycentric[p, j]
            corners[v, k] = corner
            barycentric[v, k] = total / 2.0
