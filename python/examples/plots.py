"""Error against spheres, from the results of a comparison.

    python plots.py medial-report errors.png
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import medial_axis

folder, picture = sys.argv[1:3] if len(sys.argv) > 2 else ("medial-report", "errors.png")
results = medial_axis.load(folder)
# At counts, met or not: the axis shows the reached count.
results = results[(results.level == "spheres") & results.hausdorff.notna()]
figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
for method, rows in results.groupby("method"):
    # The median over all meshes at each requested count.
    medians = rows.groupby("asked")[["spheres", "hausdorff"]].median().sort_values("spheres")
    axes.plot(medians.spheres, 100 * medians.hausdorff, marker="o", label=method)
axes.set(xscale="log", yscale="log", xlabel="spheres", ylabel="Hausdorff error, % of the diagonal")
axes.set_xticks(sorted(results.asked.unique()))
for axis in (axes.xaxis, axes.yaxis):
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter("{x:g}" if axis is axes.yaxis else "")
axes.legend()
figure.savefig(picture, dpi=150)
