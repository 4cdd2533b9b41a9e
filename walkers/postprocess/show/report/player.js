// Unpacks what the page carries, and plays its scene.
//
// K3D 3.2 has a player of its own, which also plays offline from disk, in files of the same size.
// It is not used:
// - Its speed is limited to 0.1 to 5 seconds of motion per second. Walkers need less: 24 cycles at
//   140 Hz take 0.17 s, which the slider of K3D plays in 1.7 s at most.
// - Without a graphics card, it showed 6.5 images/s of a walker and of a pile of 200 beads; this
//   player 49 and 35.
// - Its controls are folded in a panel of settings for all objects, without a unit of the time.
(() => {
  // Data of the page, by the ids of their elements.
  const text = (id) => document.getElementById(id)?.textContent;
  const bytes = (id) => Uint8Array.from(atob(text(id)), (letter) => letter.charCodeAt(0));
  const unpacked = (id) => fflate.strFromU8(fflate.unzlibSync(bytes(id)));

  // K3D is an AMD module; this is all of AMD that it needs.
  const loadLibrary = () => {
    let k3d = null;
    const define = (name, needs, make) => { k3d = make(); };
    new Function("define", unpacked("library-k3d"))(define);
    return k3d;
  };

  const SLOWDOWNS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
  // The slowdown at first is the one with which the run takes about this time.
  const PLAYING_SECONDS = 12;

  // The slowdown that is nearest to a factor, as a ratio.
  const nearestSlowdown = (factor) => {
    const distance = (slowdown) => Math.abs(Math.log(slowdown / factor));
    let nearest = SLOWDOWNS[0];
    for (const slowdown of SLOWDOWNS) {
      if (distance(slowdown) < distance(nearest)) nearest = slowdown;
    }
    return nearest;
  };

  // One scene with its controls; times are in seconds.
  class Player {
    constructor(element) {
      this.find = (selector) => element.querySelector(selector);
      this.begin = Number(element.dataset.begin);
      this.end = Number(element.dataset.end);
      this.scene = element.dataset.scene;
      this.playing = false;
      this.instance = null;
      this.addSlowdowns();
      this.addListeners();
      this.show(this.begin);
    }

    addSlowdowns() {
      const first = nearestSlowdown(PLAYING_SECONDS / (this.end - this.begin));
      for (const slowdown of SLOWDOWNS) {
        const label = slowdown === 1 ? "as fast as in reality" : `${slowdown} times slower`;
        const isFirst = slowdown === first;
        this.find(".slower").add(new Option(label, slowdown, isFirst, isFirst));
      }
    }

    addListeners() {
      this.find(".when").step = (this.end - this.begin) / 1000;
      this.find(".play").addEventListener("click", () => this.play(!this.playing));
      this.find(".when").addEventListener("input", (event) => {
        this.play(false);
        this.show(Number(event.target.value));
      });
      this.find(".first").addEventListener("click", (event) => {
        this.instance?.setCamera(JSON.parse(event.target.dataset.camera));
      });
    }

    async open() {
      const place = this.find(".scene");
      try {
        place.replaceChildren();
        const library = loadLibrary();
        this.instance = await library.CreateK3DAndLoadBinarySnapshot(bytes(this.scene), place);
        this.instance.setMenuVisibility(false);
        this.find(".play").disabled = false;
        place.dataset.ready = "yes";
        await this.show(this.now);
      } catch (error) {
        const reason = error.message ?? error;
        place.textContent = `This browser shows no 3-D picture (it needs WebGL 2): ${reason}`;
      }
    }

    async show(time) {
      this.now = Math.min(Math.max(time, this.begin), this.end);
      this.find(".when").value = this.now;
      this.find(".time").value = `${this.now.toFixed(4)} s`;
      await this.instance?.setTime(this.now);
    }

    play(start) {
      this.playing = start && this.instance !== null;
      this.find(".play").textContent = this.playing ? "Pause" : "Play";
      this.find(".play").setAttribute("aria-pressed", this.playing);
      if (!this.playing) return;
      if (this.now >= this.end) this.now = this.begin;
      let before = performance.now();
      const step = async (instant) => {
        if (!this.playing) return;
        const passed = Math.max(instant - before, 0) / 1000 / Number(this.find(".slower").value);
        before = instant;
        const next = this.now + passed;
        await this.show(next >= this.end ? this.begin : next);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
  }

  // The page shows its tables first.
  setTimeout(() => {
    for (const element of document.querySelectorAll(".player")) new Player(element).open();
    document.body.dataset.ready = "yes";
  });
})();
