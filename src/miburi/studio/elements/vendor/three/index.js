// three.js 0.180.0, as it was published: the pages import "three" from here, and so do its own files.
export * from "./three.module.min.js";
export { OrbitControls } from "./OrbitControls.js";
