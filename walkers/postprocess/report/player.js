// Unpacks what the page carries, shows the run that the address names, and plays its scene.
(() => {
  const text = (id) => document.getElementById(id)?.textContent;
  const bytes = (id) => Uint8Array.from(atob(text(id)), (one) => one.charCodeAt(0));
  const unpacked = (id) => fflate.strFromU8(fflate.unzlibSync(bytes(id)));

  let k3d = null;
  const library = () => {
    if (k3d === null) {
      // K3D is an AMD module; this is all of AMD that it needs.
      new Function("define", unpacked("library-k3d"))((name, needs, make) => { k3d = make(); });
    }
    return k3d;
  };

  const SLOWER = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
  const AIMED_SECONDS = 12;

  // One scene with its controls.
  class Player {
    constructor(element) {
      this.find = (what) => element.querySelector(what);
      this.begin = Number(element.dataset.begin);
      this.end = Number(element.dataset.end);
      this.scene = element.dataset.scene;
      this.playing = false;
      this.instance = null;
      const aimed = AIMED_SECONDS / (this.end - this.begin);
      const choice = SLOWER.reduce((best, one) => (Math.abs(Math.log(one / aimed)) < Math.abs(Math.log(best / aimed)) ? one : best));
      for (const factor of SLOWER) {
        this.find(".slower").add(new Option(factor === 1 ? "as fast as in reality" : `${factor} times slower`, factor, factor === choice, factor === choice));
      }
      this.find(".when").step = (this.end - this.begin) / 1000;
      this.find(".play").addEventListener("click", () => this.play(!this.playing));
      this.find(".when").addEventListener("input", (event) => { this.play(false); this.show(Number(event.target.value)); });
      for (const button of element.querySelectorAll("[data-camera]")) {
        button.addEventListener("click", () => this.instance?.setCamera(JSON.parse(button.dataset.camera)));
      }
      this.show(this.begin);
    }

    async open() {
      if (this.instance) return;
      try {
        this.find(".scene").replaceChildren();
        this.instance = await library().CreateK3DAndLoadBinarySnapshot(bytes(this.scene), this.find(".scene"));
        this.instance.setMenuVisibility(false);
        this.find(".play").disabled = false;
        this.find(".scene").dataset.ready = "yes";
        await this.show(this.now);
      } catch (error) {
        this.find(".scene").textContent = `This browser shows no 3-D picture (it needs WebGL 2): ${error.message ?? error}`;
      }
    }

    close() {
      this.play(false);
      this.instance?.disable();
      this.instance = null;
      this.find(".play").disabled = true;
      this.find(".scene").replaceChildren();
      delete this.find(".scene").dataset.ready;
    }

    async show(time) {
      this.now = Math.min(Math.max(time, this.begin), this.end);
      this.find(".when").value = this.now;
      this.find(".time").value = `${this.now.toFixed(4)} s`;
      await this.instance?.setTime(this.now);
    }

    play(wanted) {
      this.playing = wanted && this.instance !== null;
      this.find(".play").textContent = this.playing ? "Pause" : "Play";
      this.find(".play").setAttribute("aria-pressed", this.playing);
      if (!this.playing) return;
      if (this.now >= this.end) this.now = this.begin;
      let before = performance.now();
      const step = async (instant) => {
        if (!this.playing) return;
        const passed = Math.max(instant - before, 0) / 1000 / Number(this.find(".slower").value);
        before = instant;
        await this.show(this.now + passed >= this.end ? this.begin : this.now + passed);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
  }

  const sections = [...document.querySelectorAll("section[data-run]")];
  const bokeh = () => {
    if (!window.Bokeh) (0, eval)(unpacked("library-bokeh"));
    return window.Bokeh;
  };
  const players = new Map();
  const plotted = new Set();

  const open = (section) => {
    for (const plots of section.querySelectorAll("[data-plots]")) {
      if (plotted.has(plots)) continue;
      plotted.add(plots);
      bokeh().embed.embed_item(JSON.parse(unpacked(plots.dataset.plots)), plots);
    }
    for (const element of section.querySelectorAll(".player")) {
      if (!players.has(element)) players.set(element, new Player(element));
      players.get(element).open();
    }
  };

  const route = () => {
    const wanted = location.hash.slice(1) || sections[0]?.id;
    const chosen = sections.find((one) => one.id === wanted) ?? sections[0];
    for (const section of sections) {
      section.hidden = section !== chosen;
      if (section.hidden) section.querySelectorAll(".player").forEach((one) => players.get(one)?.close());
    }
    for (const link of document.querySelectorAll("nav a")) {
      if (link.hash === `#${chosen?.id}`) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
    }
    // The page shows its tables first.
    if (chosen) setTimeout(() => { open(chosen); document.body.dataset.ready = "yes"; });
  };
  addEventListener("hashchange", () => { route(); scrollTo(0, 0); });
  addEventListener("beforeprint", () => sections.forEach((one) => { one.hidden = false; }));
  addEventListener("afterprint", route);
  route();
})();
