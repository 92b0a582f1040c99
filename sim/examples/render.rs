//! Renders a scene file to a PNG: `render SCENE.toml OUT.png [SEED] [SAMPLES]`.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;

use groundloop_sim::{CameraSpec, Renderer, SceneSpec, World, WorldConfig};

/// A world and its camera.
#[derive(serde::Deserialize)]
struct SetUp {
    world: WorldConfig,
    camera: CameraSpec,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let scene = args.get(1).ok_or("usage: render SCENE.toml OUT.png [SEED] [SAMPLES]")?;
    let out = args.get(2).map_or("scene.png", String::as_str);
    let seed = args.get(3).map_or(Ok(1), |text| text.parse())?;
    let samples = args.get(4).map_or(Ok(2), |text| text.parse())?;

    let setup: SetUp = toml::from_str(include_str!("../tests/data/tabletop.toml"))?;
    let spec: SceneSpec = toml::from_str(&std::fs::read_to_string(scene)?)?;
    let world = World::new(&spec, &setup.world, seed)?;
    let camera = CameraSpec { samples, ..setup.camera };
    let frame = Renderer::new().render(&world, &camera, seed)?;

    let mut encoder =
        png::Encoder::new(BufWriter::new(File::create(out)?), frame.width, frame.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&frame.rgb)?;
    Ok(())
}
