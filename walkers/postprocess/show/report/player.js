// Unpacks what the page carries, and plays its scene.
//
// K3D 3.2 has a player of its own, which also plays offline from disk, in files of the same size. It is not used:
// - Its speed is limited to 0.1 to 5 seconds of motion per second. Walkers need less: 24 cycles at 140 Hz take 0.17 s,
//   which the slider of K3D plays in 1.7 s at most.
// - Without a graphics card, it showed 6.5 images/s of a walker and of a pile of 200 beads; this player 49 and 35.
// - Its controls are folded in a panel of settings for all objects, without a unit of the time.
(() => {
  const text = (id) => document.getElementById(id)?.textContent;
  const bytes = (id) => Uint8Array.from(atob(text(id)), (one) => one.charCodeAt(0));
  const unpacked = (id) => fflate.strFromU8(fflate.unzlibSync(bytes(id)));

  const library = () => {
    // K3D is an AMD module; this is all of AMD that it needs.
    let k3d = null;
    new Function("define", unpacked("library-k3d"))((name, needs, make) => { k3d = make(); });
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
      this.find(".first").addEventListener("click", (event) => this.instance?.setCamera(JSON.parse(event.target.dataset.camera)));
      this.show(this.begin);
    }

    async open() {
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

  // The page shows its tables first.
  setTimeout(() => {
    for (const element of document.querySelectorAll(".player")) new Player(element).open();
    document.body.dataset.ready = "yes";
  });
})();
