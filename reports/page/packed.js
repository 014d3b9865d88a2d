// What most readers never open stands in the page compressed, and is unpacked when it is asked for.
const page = {
  // What is gzip in Base64.
  unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  },
  unpackBytes(text) {
    return page.unpacked(text).arrayBuffer();
  },
  // The text of an element `script` that holds it so.
  unpack(element) {
    return page.unpacked(element.textContent).text();
  },
};
