// Buttons that copy what a paper takes over.
(() => {
  for (const box of document.querySelectorAll(".paste")) {
    const [button, text, said] = ["button", "pre", "output"].map((part) => box.querySelector(part));
    button.hidden = false;
    button.addEventListener("click", async () => {
      try {
        // There is none on some pages from disk, and a browser may refuse it.
        await navigator.clipboard.writeText(text.textContent);
        said.textContent = "Copied.";
      } catch {
        getSelection().selectAllChildren(text);
        text.focus();
        said.textContent = "Selected: copy it by the keyboard.";
      }
    });
  }
})();
