// Reaching in: how deep in the picture the hand goes, and what shows it.
//
// A pointer says where on the screen the hand shall be, not how far away. So the hand goes as deep
// as the arm that the pointer's ray meets, or as what is nearest to the ray on the arm's way.
import * as THREE from "three";

const NEAR = 0.02; // m from the ray: what is on it counts fully, at this distance 0.6, at twice 0.1
const MEMORY = 3000, LOOK = 100; // ms: how much of the arms' way is kept, and how often it is looked at
const FAINT = 0.02; // what the nearest place counts where nothing is near

export class ArmsWay {
  constructor(robot, links) {
    const arms = new Set(robot.links.filter((link) => /^(right|left)_/.test(link.joint)).map((link) => link.name));
    this.places = [];
    for (const part of robot.parts.filter((part) => arms.has(part.link))) {
      const start = new THREE.Vector3(...part.position);
      const end = part.end ? new THREE.Vector3(...part.end) : start;
      for (const share of part.end ? [0.25, 0.5, 0.75] : [0])
        this.places.push({ group: links[part.link], at: start.clone().lerp(end, share) });
    }
    this.trail = [];
    this.due = 0;
  }

  look(now) {
    // Where the arms are, and where they were a moment ago: a gesture comes back the way it went.
    this.now = this.places.map(({ group, at }) => group.localToWorld(at.clone()));
    if (now < this.due) return;
    this.due = now + LOOK;
    this.trail.push({ now, points: this.now });
    while (this.trail[0].now < now - MEMORY) this.trail.shift();
  }

  depth(ray, kept = null) {
    // The mean depth of all places, weighed by how near the ray passes them; where it passes none,
    // what was kept, or the depth of the nearest.
    let sum = 0, weights = 0, nearest = Infinity, otherwise = 0;
    const offset = new THREE.Vector3();
    const weigh = (points, share) => points.forEach((point) => {
      const along = offset.subVectors(point, ray.origin).dot(ray.direction);
      const off = Math.sqrt(Math.max(0, offset.lengthSq() - along * along));
      const weight = share * Math.exp(-0.5 * (off / NEAR) ** 2);
      sum += weight * along;
      weights += weight;
      if (off < nearest) [nearest, otherwise] = [off, along];
    });
    weigh(this.now, 1);
    this.trail.forEach(({ points }) => weigh(points, 0.1));
    return (sum + FAINT * (kept ?? otherwise)) / (weights + FAINT);
  }

  distance(point) {
    return Math.min(...this.now.map((place) => place.distanceTo(point)));
  }
}

export class DepthMarks {
  // A shadow straight below the hand, and a ring that closes as the hand comes near an arm.
  constructor(scene, floor, radius) {
    const mark = (geometry, colour, opacity) => {
      const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
        color: colour, transparent: true, opacity, depthWrite: false, side: THREE.DoubleSide, fog: false }));
      mesh.visible = false;
      scene.add(mesh);
      return mesh;
    };
    this.radius = radius;
    this.shadow = mark(new THREE.CircleGeometry(1.6 * radius, 32), 0x2b1b14, 0.45);
    this.shadow.position.z = floor + 0.001;
    this.thread = mark(new THREE.CylinderGeometry(0.0006, 0.0006, 1, 6), 0x3f7d86, 0.8);
    this.thread.rotation.x = Math.PI / 2;
    this.ring = mark(new THREE.RingGeometry(0.94, 1, 48), 0x3f7d86, 0.9);
    this.ring.material.depthTest = false;
    this.floor = floor;
  }

  show(hand, camera, distance) {
    const { x, y, z } = hand.position;
    for (const mark of [this.shadow, this.thread, this.ring]) mark.visible = hand.visible;
    if (!hand.visible) return;
    this.shadow.position.setX(x).setY(y);
    this.thread.position.set(x, y, (z + this.floor) / 2);
    this.thread.scale.y = Math.max(0.001, z - this.floor);
    this.ring.position.copy(hand.position);
    this.ring.quaternion.copy(camera.quaternion);
    this.ring.scale.setScalar(1.5 * this.radius + Math.min(0.05, Math.max(0, distance - 2 * this.radius)));
    this.ring.material.color.setHex(distance < 2.6 * this.radius ? 0xc81e1e : 0x3f7d86);
  }
}
