// Folding, and what an address opens.
(() => {
  const meshes = [...document.querySelectorAll("details.mesh")];
  const fold = document.querySelector(".fold");
  if (fold) {
    fold.hidden = false;
    fold.addEventListener("click", (event) => {
      const wanted = event.target.dataset.fold;
      if (wanted !== undefined) for (const mesh of meshes) mesh.open = wanted === "open";
    });
  }
  // A section that stands in the page compressed is filled when it is first opened.
  const fill = async (mesh) => {
    const packed = mesh.querySelector(":scope > script.packed");
    if (!packed) return;
    packed.remove();
    mesh.insertAdjacentHTML("beforeend", await page.unpack(packed));
    page.enlivenPlots(mesh);
    page.enlivenViews(mesh);
  };
  for (const mesh of meshes) {
    mesh.addEventListener("toggle", () => {
      if (mesh.open) fill(mesh);
    });
  }
  const openTarget = () => {
    let id = location.hash.slice(1);
    try {
      id = decodeURIComponent(id);
    } catch {
      // Not encoded: taken as it is.
    }
    const target = document.getElementById(id);
    if (target instanceof HTMLDetailsElement) {
      target.open = true;
      target.scrollIntoView();
    }
  };
  window.addEventListener("hashchange", openTarget);
  openTarget();
  window.addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details")) details.open = true;
    for (const image of document.images) image.loading = "eager";
  });
})();
