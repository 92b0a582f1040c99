//! From text to the first plan.

use std::fs;
use std::path::PathBuf;

use groundloop::pddl::SourceText;
use groundloop::planning::{Budget, Outcome, PlanRequest, plan};

use super::{cost, cpu_ms, data, quantile, read, source};

/// How often a cold start is repeated for each problem.
const REPEATS: usize = 21;

/// Text to plan, for every problem of the data set and a tower of ten disks.
pub(super) fn measure() {
    let Some(root) = data("prodgv/data") else { return };
    println!(
        "\n| parse + ground + first plan | problems | p50 ms | max ms | sum of optimal costs |"
    );
    println!("|---|---|---|---|---|");
    for name in ["blocksworld", "cooking", "hanoi"] {
        let folder = root.join(name);
        let domain = source(&folder.join("domain.pddl"));
        let mut problems: Vec<PathBuf> =
            fs::read_dir(folder.join("problems")).unwrap().map(|e| e.unwrap().path()).collect();
        problems.sort();
        let problems: Vec<SourceText> = problems.iter().map(|path| source(path)).collect();
        row(name, &domain, &problems);
    }
    let folder = root.join("hanoi/domain.pddl");
    row("hanoi, 10 disks", &source(&folder), &[ten_disks()]);
}

fn row(name: &str, domain: &SourceText, problems: &[SourceText]) {
    let (mut medians, mut sum) = (Vec::new(), 0.0);
    for problem in problems {
        let mut times = Vec::new();
        for repeat in 0..REPEATS {
            let ((domain, problem, outcome), ms) = cpu_ms(|| {
                let (domain, problem) = read(domain, problem);
                let outcome =
                    plan(&domain, &PlanRequest::new(&problem), &Budget::standard()).outcome;
                (domain, problem, outcome)
            });
            times.push(ms);
            if repeat == 0 {
                let Outcome::Solved(found) = &outcome else { panic!("{}", problem.name) };
                assert!(found.proven_optimal, "{}", problem.name);
                sum += cost(&domain, &PlanRequest::new(&problem), &outcome).unwrap_or_default();
            }
        }
        medians.push(quantile(&mut times, 0.5));
    }
    let (p50, max) = (quantile(&mut medians.clone(), 0.5), quantile(&mut medians, 1.0));
    println!("| {name} | {} | {p50:.2} | {max:.2} | {sum} |", problems.len());
}

/// A tower of ten disks on one peg, wanted on another, in the words of the data set.
fn ten_disks() -> SourceText {
    let disks: Vec<String> = (0..10).map(|i| format!("d{i}")).collect();
    let mut init = vec![format!("(clear {})", disks[9])];
    for (i, disk) in disks.iter().enumerate() {
        init.push(format!("(on-peg {disk} left)"));
        init.extend(disks[i + 1..].iter().map(|smaller| format!("(smaller {smaller} {disk})")));
    }
    init.extend(disks.windows(2).map(|pair| format!("(on {} {})", pair[1], pair[0])));
    let init = init.join(" ");
    let disks = disks.join(" ");
    SourceText::new(
        "ten disks",
        format!(
            "(define (problem ten-disks) (:domain hanoi)
              (:objects {disks} - disk left middle right - peg) (:init {init})
              (:goal (forall (?d - disk) (on-peg ?d right))))"
        ),
    )
}
