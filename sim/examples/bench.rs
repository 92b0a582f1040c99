//! CPU time of one camera frame and of one simulated second, with the gripper at work:
//! `bench SCENE.toml [FRAMES] [WIDTH] [HEIGHT]`. Linux only: reads the process's CPU time.

use std::error::Error;

use groundloop_sim::{CameraSpec, Frame, GripperCommand, Renderer, SceneSpec, World, WorldConfig};
use nalgebra::Point3;

/// CPU time of this process's only thread, in milliseconds.
fn cpu_ms() -> Result<f64, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/schedstat")?;
    let on_cpu_ns = stat.split(' ').next().ok_or("no CPU time in schedstat")?;
    Ok(on_cpu_ns.parse::<f64>()? * 1e-6)
}

/// A world and its camera.
#[derive(serde::Deserialize)]
struct SetUp {
    world: WorldConfig,
    camera: CameraSpec,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let scene = args.get(1).ok_or("usage: bench SCENE.toml [FRAMES] [WIDTH] [HEIGHT]")?;
    let n_frames = args.get(2).map_or(Ok(600), |text| text.parse::<u32>())?;
    let width = args.get(3).map_or(Ok(640), |text| text.parse())?;
    let height = args.get(4).map_or(Ok(480), |text| text.parse())?;

    let setup: SetUp = toml::from_str(include_str!("../tests/data/tabletop.toml"))?;
    let spec: SceneSpec = toml::from_str(&std::fs::read_to_string(scene)?)?;
    let mut world = World::new(&spec, &setup.world, 1)?;
    let camera = CameraSpec { width, height, ..setup.camera };
    let mut renderer = Renderer::new();
    let mut frame = Frame::default();
    renderer.render_into(&world, &camera, 0, &mut frame)?;

    let (mut physics_ms, mut render_ms, mut sum) = (0.0, 0.0, 0_u64);
    let n_frames_a_block = 20;
    for block in 0..n_frames / n_frames_a_block {
        let x = if block % 2 == 0 { 0.2 } else { -0.2 };
        let position = Point3::new(x, 0.0, 0.08);
        let command = GripperCommand { position, yaw_rad: 0.0, opening_m: 0.08, speed_m_s: 0.3 };
        world.command(&command)?;
        let start = cpu_ms()?;
        let mut worlds = Vec::new();
        for _ in 0..n_frames_a_block {
            world.advance_to(world.time_ns() + 33_333_333);
            worlds.push(world.clone());
        }
        let middle = cpu_ms()?;
        for (k, world) in worlds.iter().enumerate() {
            renderer.render_into(world, &camera, k as u64, &mut frame)?;
            sum = sum.wrapping_add(u64::from(frame.rgb[k]));
        }
        physics_ms += middle - start;
        render_ms += cpu_ms()? - middle;
    }
    let n = f64::from(n_frames);
    let report = format!(
        "{} bodies, {width} x {height}: {:.2} ms CPU a frame, {:.2} ms CPU a simulated second \
         (with one copy of the world a frame), check {sum}\n",
        world.bodies().len(),
        render_ms / n,
        physics_ms / n * 30.0,
    );
    std::io::Write::write_all(&mut std::io::stdout(), report.as_bytes())?;
    Ok(())
}
