// Browsers start no worker of a page that lies on the disk, and the search of this site runs in one. Such a page gets
// a worker that is a hidden frame instead: the same script, the same messages.

if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.onmessage = null;
      const frame = Object.assign(document.createElement("iframe"), { hidden: true });
      this.ready = new Promise((done) => {
        const start = () => {
          document.body.append(frame);
          const inner = frame.contentWindow;
          inner.postMessage = (data) => this.tell(data);
          inner.importScripts = (...urls) => urls.reduce((last, one) => last.then(() => load(inner, one)), Promise.resolve());
          load(inner, url).then(() => done(inner));
        };
        if (document.body) start();
        else addEventListener("DOMContentLoaded", start);
      });
    }

    postMessage(data) {
      this.ready.then((inner) => inner.dispatchEvent(new MessageEvent("message", { data })));
    }

    tell(data) {
      const event = new MessageEvent("message", { data });
      this.dispatchEvent(event);
      this.onmessage?.(event);
    }

    terminate() {}
  };
}

function load(inner, url) {
  return new Promise((done, failed) => {
    const script = inner.document.createElement("script");
    Object.assign(script, { src: new URL(url, location.href).href, onload: done, onerror: failed });
    inner.document.documentElement.append(script);
  });
}
