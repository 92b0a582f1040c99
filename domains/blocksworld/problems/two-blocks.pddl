; The smallest task with something to do: 2 steps.
(define (problem two-blocks)
  (:domain blocksworld)
  (:objects
    blue_block red_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable blue_block) (clear blue_block)
    (ontable red_block) (clear red_block))
  (:goal (on red_block blue_block)))
