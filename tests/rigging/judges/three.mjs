// node three.mjs NODE_MODULES BROWSER FILE: loads a rig with three.js, and prints as JSON the names of its shapes, how many
// pixels each of them changes, and whether the neutral face comes back pixel by pixel.
import { createRequire } from "node:module";
import { readFileSync, writeFileSync } from "node:fs";
const [, , modules, browser, file] = process.argv;
const puppeteer = createRequire(`${modules}/`)("puppeteer-core");
const page = `${file}.three.html`;
writeFileSync(page, `<!doctype html><script type="importmap">{"imports": {"three": "file://${modules}/three/build/three.module.js"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "file://${modules}/three/examples/jsm/loaders/GLTFLoader.js";
const data = Uint8Array.from(atob("${readFileSync(file).toString("base64")}"), c => c.charCodeAt(0)).buffer;
const gltf = await new GLTFLoader().parseAsync(data, "");
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(240, 240);
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(30, 1, 0.01, 10);
const lamp = new THREE.DirectionalLight(0xffffff, 3);
lamp.position.set(0.5, 1, 1.5);
scene.add(gltf.scene, lamp, new THREE.AmbientLight(0xffffff, 0.5));
const box = new THREE.Box3().setFromObject(gltf.scene), middle = box.getCenter(new THREE.Vector3());
camera.position.set(middle.x, middle.y, middle.z + 1.6 * box.getSize(new THREE.Vector3()).y);
camera.lookAt(middle);
const meshes = [];
gltf.scene.traverse(node => { if (node.isMesh) meshes.push(node); });
function seen() {
  renderer.render(scene, camera);
  const gl = renderer.getContext(), pixels = new Uint8Array(240 * 240 * 4);
  gl.readPixels(0, 0, 240, 240, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return pixels;
}
const differ = (a, b) => { let n = 0; for (let i = 0; i < a.length; i += 4) n += a[i] !== b[i] || a[i + 1] !== b[i + 1] || a[i + 2] !== b[i + 2]; return n; };
const set = (name, weight) => meshes.forEach(mesh => { mesh.morphTargetInfluences[mesh.morphTargetDictionary[name]] = weight; });
seen();
const rest = seen(), names = Object.keys(meshes[0].morphTargetDictionary), changed = {};
for (const name of names) { set(name, 1); changed[name] = differ(rest, seen()); set(name, 0); }
window.found = { names, changed, back: differ(rest, seen()), meshes: meshes.length,
  same: meshes.every(mesh => JSON.stringify(Object.keys(mesh.morphTargetDictionary)) === JSON.stringify(names)) };
</script>`);
const options = ["--no-sandbox", "--allow-file-access-from-files", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const chromium = await puppeteer.launch({ executablePath: browser, args: options });
try {
  const tab = await chromium.newPage();
  tab.on("pageerror", error => console.error(error.message));
  await tab.goto(`file://${page}`);
  await tab.waitForFunction("window.found", { timeout: 120000 });
  console.log(JSON.stringify(await tab.evaluate("window.found")));
} finally {
  await chromium.close();
}
