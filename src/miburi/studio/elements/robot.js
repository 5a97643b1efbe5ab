// The robot in 3D, built from the description, moved by the partner's states; and a hand to drag.
import * as THREE from "three";
import { listen, send } from "/static/live.js";
import { clipKind, download, film, Past } from "/static/clip.js";
import { ArmsWay, DepthMarks } from "/static/reach.js";
import { Blinker, drawOn, Easer, enliven, led, lips, mix, tintOf } from "/static/face.js";

const LIGHT = { wall: 0xf3ebe0, table: 0xe6dccf, sky: 0xffffff, ground: 0xd9c7b4, strength: 1.5 };
const DARK = { wall: 0x1d1b1e, table: 0x2b2729, sky: 0x9fb2d6, ground: 0x30241e, strength: 0.75 };
const STEERED = 1500, AGAIN = 300; // ms
const EYE = [0.62, -0.27, 0.2], LOOK_AT = [0, 0, 0.1];
// From the table to a phone's upper edge, m: a taller robot is seen from further away.
const TALL = 0.32;

export default {
  template: `<div class="robot-view" style="position:absolute;inset:0">
    <canvas ref="canvas" tabindex="0" role="img" :aria-label="label"
      style="width:100%;height:100%;display:block;outline-offset:-4px"></canvas>
    <button v-if="clips && !blind" class="plain-button clip" type="button" :disabled="filming" @click="save">
      {{ filming ? words.clip_making : words.clip }}</button>
    <p v-if="blind" class="blind">{{ words.no_3d }}</p></div>`,
  props: { robot: Object, faces: Object, label: String, words: Object },
  data: () => ({ blind: false, clips: Boolean(clipKind()), filming: false }),

  async mounted() {
    // Without WebGL the rest of the page works all the same.
    this.blind = !document.createElement("canvas").getContext("webgl2");
    if (this.blind) return;
    this.renderer = new THREE.WebGLRenderer({ canvas: this.$refs.canvas, antialias: true });
    // ?quality=full or low: for pictures, and for very slow devices; else it is found out.
    const quality = new URLSearchParams(location.search).get("quality");
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(33, 1, 0.02, 20);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, this.$refs.canvas);
    // A finger scrolls past the scene; only where it takes the hand does the page stay.
    this.$refs.canvas.style.touchAction = "pan-y";
    Object.assign(this.controls, { minDistance: 0.25, maxDistance: 1.6, maxPolarAngle: 1.62, enableDamping: true });
    this.light();
    this.build();
    this.reset();
    this.shade();
    this.dragging();
    this.theme = new MutationObserver(() => this.shade());
    this.theme.observe(document.body, { attributeFilter: ["class"] });
    this.sizes = new ResizeObserver(() => this.fit());
    this.sizes.observe(this.$el);
    this.fit();
    this.$el.view = this; // for tests and pictures
    this.angles = [...this.robot.neutral];
    this.goal = this.angles;
    this.weights = [];
    this.past = new Past();
    this.unlisten = listen((state) => this.take(state));
    if (quality === "low") this.lighten();
    let last = performance.now(), faceDue = 0, frames = 0, slow = 0;
    this.renderer.setAnimationLoop((now) => {
      if (this.light_weight && now - last < 110) return;
      // The time of a frame that began before `last` was taken lies before it.
      const dt = Math.max(0, Math.min(0.15, (now - last) / 1000));
      // A device that cannot keep up gets fewer pixels, fewer pictures, and no shadows.
      if (++frames > 10 && frames < 60 && now - last > 90 && !quality && ++slow === 12) this.lighten();
      last = now;
      // Between two states the joints go on smoothly.
      const share = 1 - Math.exp(-dt / 0.035);
      this.angles = this.angles.map((angle, i) => angle + share * (this.goal[i] - angle));
      this.robot.joints.forEach((name, i) => this.joints[name].forEach((turn) => turn(this.angles[i])));
      if (now > faceDue) {
        faceDue = now + 90;
        this.drawFace(now / 1000, 0.09);
      }
      this.controls.update();
      this.arms.look(now);
      this.marks.show(this.hand, this.camera, this.arms.distance(this.hand.position));
      this.renderer.render(this.scene, this.camera);
    });
  },

  beforeUnmount() {
    this.unlisten?.();
    this.sizes?.disconnect();
    this.theme?.disconnect();
    this.renderer?.setAnimationLoop(null);
    this.renderer?.dispose();
    window.removeEventListener("pointerup", this.drop);
    window.removeEventListener("pointercancel", this.drop);
  },

  methods: {
    take(state) {
      if (!state) return;
      this.goal = state.angles;
      this.weights = state.face;
      led.eyes = state.eyes;
      this.past.keep(state);
      const pose = state.hand;
      this.hand.visible = state.hand_out;
      // A hand that goes and comes again under a pressed pointer is still held.
      this.held = Boolean(this.pressed && state.hand_out);
      if (this.held && performance.now() > this.told + AGAIN) {
        // A held hand goes as deep as the arms that have passed under the pointer since it came
        // there. Its place is sent again, in case the connection dropped it.
        if (!state.force && !state.stop) {
          const deep = this.ray.origin.distanceTo(this.wish) + this.nearer;
          this.follow(this.ray, deep);
        }
        this.tell();
      }
      if (state.hand_out && !this.held) {
        // One takes hold of the hand where one sees it, on its way to a wish as well.
        this.handle.position.set(...pose.position);
        if (performance.now() > this.steered) this.wish.copy(this.handle.position);
      }
      if (pose) {
        this.hand.position.set(...pose.position);
        const [w, x, y, z] = pose.quaternion;
        this.hand.quaternion.set(x, y, z, w);
      }
      const glow = state.stop?.reason === "contact" ? state.stop.motor : null;
      if (glow !== this.glowing) this.light_up(glow);
      this.skin.emissiveIntensity = Math.min(1, (state.force ?? 0) / 8);
      this.ready = true;
    },

    light_up(motor) {
      // The link that the motor turns glows.
      for (const mesh of this.meshes) {
        const on = motor && this.turned[motor] === mesh.userData.link;
        mesh.material.emissive.setHex(on ? 0xc81e1e : 0);
        mesh.material.emissiveIntensity = on ? 0.55 : 0;
      }
      this.glowing = motor;
    },

    light() {
      this.hemisphere = new THREE.HemisphereLight(0xffffff, 0xd9c7b4, 1.5);
      this.hemisphere.position.set(0, 0, 1);
      const sun = (this.sun = new THREE.DirectionalLight(0xfff1dd, 2.1));
      sun.position.set(0.55, -0.5, 0.95);
      sun.castShadow = true;
      sun.shadow.mapSize.set(1024, 1024);
      Object.assign(sun.shadow.camera, { left: -0.4, right: 0.4, top: 0.45, bottom: -0.35, near: 0.2, far: 2.4 });
      sun.shadow.radius = 5;
      sun.shadow.bias = -0.0004;
      sun.shadow.normalBias = 0.0015;
      const rim = (this.rim = new THREE.DirectionalLight(0xcfe0ff, 0.7));
      rim.position.set(-0.7, 0.7, 0.5);
      this.scene.add(this.hemisphere, sun, rim);
    },

    shade() {
      const dark = document.body.classList.contains("body--dark");
      const tone = dark ? DARK : LIGHT;
      this.scene.background = new THREE.Color(tone.wall);
      this.scene.fog = new THREE.Fog(tone.wall, 0.9, 2.6);
      this.table.material.color.setHex(tone.table);
      this.hemisphere.color.setHex(tone.sky);
      this.hemisphere.groundColor.setHex(tone.ground);
      this.hemisphere.intensity = tone.strength;
      this.sun.intensity = dark ? 1.5 : 2.1;
    },

    build() {
      const robot = this.robot;
      this.table = new THREE.Mesh(
        new THREE.CircleGeometry(4, 64),
        new THREE.MeshStandardMaterial({ roughness: 0.95 }),
      );
      this.table.position.z = robot.floor;
      this.table.receiveShadow = true;
      this.scene.add(this.table);
      const base = robot.links[0].parent;
      const links = { [base]: new THREE.Group() };
      this.scene.add(links[base]);
      this.joints = Object.fromEntries(robot.joints.map((name) => [name, []]));
      this.turned = Object.fromEntries(robot.links.map((link) => [link.joint, link.name]));
      for (const link of robot.links) {
        const group = (links[link.name] = new THREE.Group());
        group.position.set(...link.position);
        const axis = new THREE.Vector3(...link.axis);
        this.joints[link.joint].push((angle) => group.quaternion.setFromAxisAngle(axis, angle));
        links[link.parent].add(group);
      }
      this.meshes = [];
      for (const part of robot.parts) {
        const mesh = solid(part);
        Object.assign(mesh.userData, { link: part.link, phone: part.name.startsWith("phone") });
        mesh.castShadow = mesh.receiveShadow = true;
        mesh.visible = !part.name.startsWith("screen"); // the face takes its place
        links[part.link].add(mesh);
        this.meshes.push(mesh);
      }
      this.face(links);
      this.dress(links);
      const [radius, half] = robot.hand;
      this.skin = new THREE.MeshStandardMaterial({ color: 0xdba98a, roughness: 0.6, emissive: 0xff2a1a, emissiveIntensity: 0 });
      this.hand = new THREE.Group();
      const fingers = new THREE.Mesh(new THREE.CapsuleGeometry(radius, 2 * half, 8, 20), this.skin);
      fingers.rotation.x = Math.PI / 2;
      fingers.castShadow = true;
      this.hand.add(fingers, ...palm(radius, half, this.skin));
      this.hand.visible = false;
      this.scene.add(this.hand);
      // An invisible ball around it is easier to catch with a finger.
      this.handle = new THREE.Mesh(new THREE.SphereGeometry(2.6 * radius), new THREE.MeshBasicMaterial());
      this.handle.visible = false;
      this.handle.position.set(...robot.hand_away);
      this.wish = this.handle.position.clone();
      this.nearer = 0;
      this.scene.add(this.handle);
      this.arms = new ArmsWay(robot, links);
      this.marks = new DepthMarks(this.scene, robot.floor, radius);
      this.steered = 0; // until when the wish is somebody's, whatever the hand does
    },

    async dress(links) {
      // A robot that can be built is drawn as it is printed; until its shapes come, simply.
      const answer = await fetch("/api/page/shapes").catch(() => null);
      const shapes = answer?.ok ? await answer.json() : [];
      if (!shapes.length) return;
      for (const mesh of this.meshes) mesh.visible &&= mesh.userData.phone;
      for (const { link, colour, points, faces } of shapes) {
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(unpacked(points)), 3));
        geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(unpacked(faces)), 1));
        const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({
          color: new THREE.Color().setRGB(...colour.slice(0, 3), THREE.SRGBColorSpace),
          roughness: 0.6, flatShading: true,
        }));
        mesh.userData.link = link;
        mesh.castShadow = mesh.receiveShadow = true;
        links[link].add(mesh);
        this.meshes.push(mesh);
      }
      this.dressed = true; // for tests and pictures
    },

    face(links) {
      // The face on the phone: a canvas in front of the screen.
      const screens = this.robot.parts.filter((part) => part.name.startsWith("screen"));
      const screen = screens.find((part) => part.name === "screen") ?? screens[0];
      const wide = Math.max(...screens.map((part) => part.size[1] ?? 0)), high = screen.size[2];
      this.screenHeight = Math.round((384 * high) / wide);
      Object.assign(this, this.screenCanvas());
      const shape = rounded(2 * wide, 2 * high, 0.16 * wide);
      const geometry = new THREE.ShapeGeometry(shape, 12);
      const at = geometry.attributes.position, uv = geometry.attributes.uv;
      for (let i = 0; i < at.count; i++)
        uv.setXY(i, at.getX(i) / (2 * wide) + 0.5, at.getY(i) / (2 * high) + 0.5);
      this.screen = new THREE.MeshBasicMaterial({
        map: this.texture, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2000,
      });
      const plane = new THREE.Mesh(geometry, this.screen);
      const group = new THREE.Group();
      group.quaternion.setFromAxisAngle(new THREE.Vector3(0, -1, 0), screen.tilt);
      group.position.set(...screen.position);
      // The plane's x is the robot's left as seen by the viewer; its y is up.
      plane.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(
        new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1), new THREE.Vector3(1, 0, 0)));
      plane.position.x = screen.size[0] + 0.0006;
      group.add(plane);
      links[screen.link].add(group);
    },

    screenCanvas() {
      // What a face is drawn on, and what moves it.
      const canvas = Object.assign(document.createElement("canvas"), { width: 384, height: this.screenHeight });
      const texture = new THREE.CanvasTexture(canvas);
      texture.colorSpace = THREE.SRGBColorSpace;
      return { canvas, texture, easer: new Easer(this.faces.feelings.length), blinker: new Blinker() };
    },

    drawFace(time, dt) {
      const look = enliven(mix(this.faces, this.easer.towards(this.weights, dt)), performance.now());
      const { width, height } = this.canvas;
      const context = this.canvas.getContext("2d");
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.fillStyle = tintOf(look);
      context.fillRect(0, 0, width, height);
      const size = Math.min(width, height) * 0.98;
      context.translate((width - size) / 2, (height - size) * 0.45);
      const talks = lips.open(performance.now()) !== null;
      drawOn(context, size, look, time, this.blinker.at(time, talks));
      this.texture.needsUpdate = true;
    },

    async save() {
      this.filming = true;
      const moments = [...this.past.moments], recall = (moment) => this.recall(moment);
      try {
        download(await film(moments, this.scene, this.camera, recall, this.light_weight));
      } finally {
        this.filming = false;
      }
    },

    recall(moment) {
      // Show a moment that has been; returns what shows the present again.
      const { canvas, texture, weights, blinker, easer } = this;
      const { position, quaternion, visible } = this.hand;
      const now = { position: position.clone(), quaternion: quaternion.clone(), visible };
      const turn = (angles) =>
        this.robot.joints.forEach((name, i) => this.joints[name].forEach((joint) => joint(angles[i])));
      turn(moment.angles);
      this.hand.visible = moment.out;
      if (moment.hand) {
        const [w, x, y, z] = moment.hand.quaternion;
        position.set(...moment.hand.position);
        quaternion.set(x, y, z, w);
      }
      this.recalled ??= this.screenCanvas();
      Object.assign(this, this.recalled, { weights: moment.face });
      this.screen.map = this.texture;
      this.drawFace(moment.at / 1000, 1);
      return () => {
        Object.assign(this, { canvas, texture, weights, blinker, easer });
        this.screen.map = texture;
        turn(this.angles);
        position.copy(now.position);
        quaternion.copy(now.quaternion);
        this.hand.visible = now.visible;
      };
    },

    reset() {
      if (this.blind) return;
      const { links, parts, floor } = this.robot;
      const screen = parts.find((part) => part.name === "screen");
      const neck = links.find((link) => link.joint === "head")?.position[2] ?? 0;
      const tall = screen ? neck + Math.hypot(...screen.position) + screen.size[2] - floor : 0;
      const away = Math.max(1, tall / TALL);
      this.camera.position.set(...EYE.map((value) => value * away));
      this.controls.target.set(...LOOK_AT.map((value) => value * away));
      this.controls.update();
      this.fit?.();
    },

    lighten() {
      this.light_weight = true;
      this.renderer.shadowMap.enabled = false;
      this.sun.castShadow = false;
      this.renderer.setPixelRatio(0.6);
      this.fit();
    },

    fit() {
      const { clientWidth: width, clientHeight: height } = this.$el;
      if (!width || !height) return;
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      // On a narrow page the arms must fit, too, and the hand beside them.
      const wide = THREE.MathUtils.radToDeg(2 * Math.atan(0.44 / this.camera.aspect));
      this.camera.fov = Math.max(33, Math.min(70, wide));
      this.camera.updateProjectionMatrix();
    },

    tell() {
      // The fingers lie across the line of sight, as those of somebody who reaches in.
      const along = new THREE.Vector3().subVectors(this.wish, this.camera.position).cross(this.camera.up).normalize();
      const limit = (x) => Math.max(-0.6, Math.min(0.6, x));
      const position = this.wish.toArray().map(limit);
      position[2] = Math.max(this.robot.floor + 0.02, position[2]);
      this.told = performance.now();
      send({ do: "hand", position: position.map((x) => Number(x.toFixed(4))), along: along.toArray() });
    },

    reach(place) {
      // The hand comes out; the arrow keys move it at once.
      if (this.blind) return;
      this.wish.set(...place);
      this.nearer = 0;
      this.steered = performance.now() + STEERED;
      this.$refs.canvas.focus({ preventScroll: true });
    },

    follow(ray, kept) {
      // Put the wish on a ray, as deep as the arm there; `nearer` is what the keys add.
      ray.at(this.arms.depth(ray, kept) - this.nearer, this.wish);
    },

    dragging() {
      const canvas = this.$refs.canvas;
      const caster = new THREE.Raycaster();
      const aim = (event) => {
        const box = canvas.getBoundingClientRect();
        caster.setFromCamera(new THREE.Vector2(
          (2 * (event.clientX - box.left)) / box.width - 1,
          1 - (2 * (event.clientY - box.top)) / box.height), this.camera);
      };
      let due = 0, later = 0;
      canvas.addEventListener("pointerdown", (event) => {
        if (!this.hand.visible) return;
        aim(event);
        this.handle.updateMatrixWorld();
        if (!caster.intersectObject(this.handle).length) return;
        this.held = this.pressed = true;
        this.told = Infinity; // until it is moved
        this.nearer = 0;
        this.controls.enabled = false;
        canvas.setPointerCapture(event.pointerId);
        event.stopImmediatePropagation();
      }, { capture: true });
      canvas.addEventListener("pointermove", (event) => {
        aim(event);
        if (!this.held) {
          const over = this.hand.visible && caster.intersectObject(this.handle).length;
          canvas.style.cursor = over ? "grab" : "default";
          return;
        }
        canvas.style.cursor = "grabbing";
        this.ray = caster.ray.clone();
        this.follow(this.ray);
        if (performance.now() > due) {
          due = performance.now() + 30;
          this.tell();
        } else {
          // Where the pointer comes to rest is told, too, however quickly it came there.
          later ||= setTimeout(() => {
            later = 0;
            if (this.held) this.tell();
          }, 30);
        }
      });
      this.drop = () => {
        this.controls.enabled = true;
        this.pressed = false;
        if (!this.held) return;
        this.held = false;
        this.steered = performance.now() + STEERED;
        this.tell();
      };
      window.addEventListener("pointerup", this.drop);
      window.addEventListener("pointercancel", this.drop);
      canvas.addEventListener("touchstart", (event) => this.held && event.preventDefault(), { passive: false });
      // By keyboard: arrows move the hand across the view, with Shift towards and away.
      canvas.addEventListener("keydown", (event) => {
        const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!steps || !(this.hand.visible || performance.now() < this.steered)) return;
        event.preventDefault();
        this.steered = performance.now() + STEERED;
        const right = new THREE.Vector3(), up = new THREE.Vector3(), back = new THREE.Vector3();
        this.camera.matrixWorld.extractBasis(right, up, back);
        this.wish.addScaledVector(right, 0.01 * steps[0]);
        if (!event.shiftKey) this.wish.addScaledVector(up, 0.01 * steps[1]);
        const way = new THREE.Vector3().subVectors(this.wish, this.camera.position).normalize();
        if (event.shiftKey) {
          // From where it is: the depth of the arms may be another by now.
          this.nearer -= 0.01 * steps[1];
          this.wish.addScaledVector(way, 0.01 * steps[1]);
        } else this.follow(new THREE.Ray(this.camera.position, way));
        this.tell();
      });
    },

    screenOf(x, y, z) {
      // Where a point of the base frame is on the page, in pixels.
      const box = this.$refs.canvas.getBoundingClientRect();
      const p = new THREE.Vector3(x, y, z).project(this.camera);
      return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
    },
  },
};

function palm(radius, half, skin) {
  // What belongs to the two fingers that can touch, behind them: only seen.
  const at = (mesh, x, y, z) => {
    mesh.position.set(x, y, z);
    mesh.castShadow = true;
    return mesh;
  };
  const back = new THREE.Mesh(new THREE.SphereGeometry(1, 28, 20), skin);
  back.scale.set(0.62 * half, 0.95 * radius, 0.95 * half);
  const thumb = new THREE.Mesh(new THREE.CapsuleGeometry(0.6 * radius, 0.8 * half, 6, 14), skin);
  thumb.rotation.set(Math.PI / 2, 0, -0.75);
  const cloth = new THREE.MeshStandardMaterial({ color: 0x3f7d86, roughness: 0.9 });
  const sleeve = new THREE.Mesh(new THREE.CylinderGeometry(1.9 * radius, 2.2 * radius, 3 * half, 28), cloth);
  sleeve.rotation.x = Math.PI / 2;
  const knuckle = new THREE.Mesh(new THREE.CapsuleGeometry(0.8 * radius, 1.1 * half, 6, 16), skin);
  knuckle.rotation.x = Math.PI / 2;
  return [at(back, 0.2 * half, 0, -1.55 * half), at(thumb, -0.62 * half, 0, -1.25 * half),
    at(knuckle, 0.62 * half, 0, -0.55 * half), at(sleeve, 0.1 * half, 0, -3.8 * half)];
}

function rounded(width, height, r) {
  const [x, y] = [width / 2, height / 2];
  const s = new THREE.Shape();
  s.moveTo(-x + r, -y);
  s.lineTo(x - r, -y).absarc(x - r, -y + r, r, -Math.PI / 2, 0);
  s.lineTo(x, y - r).absarc(x - r, y - r, r, 0, Math.PI / 2);
  s.lineTo(-x + r, y).absarc(-x + r, y - r, r, Math.PI / 2, Math.PI);
  s.lineTo(-x, -y + r).absarc(-x + r, -y + r, r, Math.PI, 1.5 * Math.PI);
  return s;
}

function unpacked(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

function solid(part) {
  const [red, green, blue, alpha] = part.colour;
  const colour = new THREE.Color().setRGB(red, green, blue, THREE.SRGBColorSpace);
  const phone = part.name.startsWith("phone");
  const material = new THREE.MeshStandardMaterial({
    color: colour, roughness: phone ? 0.35 : 0.55, metalness: phone ? 0.2 : 0,
    transparent: alpha < 1, opacity: alpha,
  });
  const start = new THREE.Vector3(...part.position);
  let geometry, middle = start, turn = new THREE.Quaternion();
  if (part.end) {
    const way = new THREE.Vector3(...part.end).sub(start);
    middle = start.clone().addScaledVector(way, 0.5);
    turn.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.clone().normalize());
    geometry = part.kind === "capsule"
      ? new THREE.CapsuleGeometry(part.size[0], way.length(), 10, 28)
      : new THREE.CylinderGeometry(part.size[0], part.size[0], way.length(), 48);
  } else {
    turn.setFromAxisAngle(new THREE.Vector3(0, -1, 0), part.tilt);
    geometry = part.kind === "box"
      ? new THREE.BoxGeometry(...part.size.map((half) => 2 * half))
      : new THREE.SphereGeometry(1, 40, 28);
    if (part.kind === "sphere") geometry.scale(part.size[0], part.size[0], part.size[0]);
    if (part.kind === "ellipsoid") geometry.scale(...part.size);
  }
  const mesh = new THREE.Mesh(geometry, material);
  mesh.position.copy(middle);
  mesh.quaternion.copy(turn);
  return mesh;
}
