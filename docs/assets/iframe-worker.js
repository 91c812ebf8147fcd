/* Browsers start no worker for a page from disk. The search, which needs one, then runs in a frame of the page. */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      frame.srcdoc = "<!doctype html><title>Search</title>";
      this.inside = new Promise((resolve) => frame.addEventListener("load", () => resolve(frame.contentWindow), { once: true }))
        .then(async (inside) => {
          inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
          inside.importScripts = (...urls) => Promise.all(urls.map((each) => this.load(inside, each)));
          await this.load(inside, url);
          return inside;
        });
      document.body.append(frame);
    }

    load(inside, url) {
      const script = inside.document.createElement("script");
      script.src = new URL(url, location.href);
      const loaded = new Promise((resolve, reject) => Object.assign(script, { onload: resolve, onerror: reject }));
      inside.document.head.append(script);
      return loaded;
    }

    postMessage(data) {
      this.inside.then((inside) => inside.dispatchEvent(new MessageEvent("message", { data })));
    }
  };
}
