// The part of three.js that viewer.js and its users draw with; bundle.sh makes three.js of it.
export {
  AmbientLight, Box3, BufferAttribute, BufferGeometry, CanvasTexture, Color, DataTexture, DirectionalLight,
  DoubleSide, Euler, FrontSide, Group, HemisphereLight, Line, LineBasicMaterial, LineSegments,
  LinearFilter, MathUtils, Matrix4, Mesh, MeshBasicMaterial, MeshStandardMaterial, NearestFilter,
  OrthographicCamera, Plane, Quaternion, RGBAFormat, Raycaster, SRGBColorSpace, Scene,
  SphereGeometry, Texture, Triangle, Vector2, Vector3, WebGLRenderer
} from "three";
export {OrbitControls} from "three/addons/controls/OrbitControls.js";
export {TransformControls} from "three/addons/controls/TransformControls.js";
