// What most readers never open stands in the page compressed, and is unpacked when it is asked for.
const page = {
  // The text of an element `script` that holds it as gzip in Base64.
  async unpack(element) {
    const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  },
};
