#!/bin/sh
# Keeps the largest balls of a medial mesh, with the edges and faces between them.
#
#     largest.sh INITIAL.ma OUTPUT.ma SPHERES
set -eu
initial=$1 output=$2 spheres=$3

# The numbers of the largest balls, in ascending order; equal radii by number.
awk '$1 == "v" { print n++, $5 }' "$initial" | sort -k2,2gr -k1,1n | head -n "$spheres" | sort -n >"$output.kept"

# The file of the balls first, then that of the medial mesh: each line that is kept, renumbered.
awk '
    FNR == NR { new[$1] = balls++; next }
    $1 == "v" { if ((n + 0) in new) line[lines++] = $0; n++ }
    $1 == "e" && ($2 in new) && ($3 in new) { line[lines++] = "e " new[$2] " " new[$3]; edges++ }
    $1 == "f" && ($2 in new) && ($3 in new) && ($4 in new) {
        line[lines++] = "f " new[$2] " " new[$3] " " new[$4]; faces++
    }
    END {
        print balls + 0, edges + 0, faces + 0
        for (i = 0; i < lines; i++) print line[i]
    }' "$output.kept" "$initial" >"$output"
