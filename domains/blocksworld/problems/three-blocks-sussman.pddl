; The Sussman anomaly: neither half of the goal can be reached first and kept. 6 steps.
(define (problem three-blocks-sussman)
  (:domain blocksworld)
  (:objects
    blue_block green_block red_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable red_block) (on green_block red_block) (clear green_block)
    (ontable blue_block) (clear blue_block))
  (:goal (and
    (on blue_block green_block)
    (on red_block blue_block))))
